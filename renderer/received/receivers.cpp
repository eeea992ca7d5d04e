// SPDX-License-Identifier: Apache-2.0
#include "renderer/received/receivers.hpp"

#include "renderer/shapes/lit_facets.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Unit vector at a longitude and a sine of latitude.
Vec3 radial(double longitude_rad, double sine) {
    const double cosine = std::sqrt(std::max(0.0, 1 - sine * sine));
    return {cosine * std::cos(longitude_rad), cosine * std::sin(longitude_rad), sine};
}

} // namespace

Receivers::Receivers(const BuiltBody& body, std::int32_t index, std::size_t rows)
    : shape_(*body.shape), index_(index), radius_m_(1.001 * body.shape->bounding_radius_m()) {
    if (const FacetSet* const set = shape_.facets()) {
        patches_.resize(set->triangle_count());
        for (const FacetSet::Facet& facet : set->facets()) {
            const TriangleCorners c = set->corners(facet.triangle);
            const Vec3 area = cross(c[1] - c[0], c[2] - c[0]) / 2;
            const double size = length(area);
            if (!(size > 0)) continue;
            patches_[facet.triangle] = {(c[0] + c[1] + c[2]) / 3, area / size, size};
            order_.push_back(facet.triangle);
        }
    } else {
        rows_ = rows;
        patches_.resize(2 * rows * rows);
        for (std::size_t i = 0; i < patches_.size(); ++i)
            order_.push_back(static_cast<std::uint32_t>(i));
        // Centres, and areas by points at the middle: of those a map is made, sums use the points themselves.
        Doubles middle;
        std::fill_n(middle.v, packet_size, 0.5);
        PatchPoints at;
        for (std::size_t p = 0; p < packets(); ++p) {
            points(p, middle, middle, 1, at);
            for (std::size_t i = 0; i < at.count; ++i) {
                const auto lane = static_cast<int>(i);
                patches_[at.patch[i]] = {at.surface.position.lane(lane), at.surface.facet_normal.lane(lane),
                                         at.area_m2[lane]};
            }
        }
    }
    for (const Patch& patch : patches_)
        area_m2_ += patch.area_m2;
}

std::vector<Vec3> Receivers::corners(std::size_t patch) const {
    if (facets()) {
        const TriangleCorners c = shape_.facets()->corners(static_cast<std::uint32_t>(patch));
        return {c.begin(), c.end()};
    }
    const auto row = static_cast<double>(patch / (2 * rows_)),
               column = static_cast<double>(patch % (2 * rows_));
    const double step = std::numbers::pi / static_cast<double>(rows_);
    const double north = std::numbers::pi / 2 - row * step, south = north - step;
    const double west = -std::numbers::pi + column * step, east = west + step;
    const double height = length(patches_[patch].centre_m);
    std::vector<Vec3> out;
    for (const auto& [longitude, latitude] :
         {std::pair{west, north}, {west, south}, {east, south}, {east, north}}) {
        const Vec3 up = radial(longitude, std::sin(latitude));
        const Vec3 radii = shape_.ellipsoid_radii_m();
        out.push_back(radii.x > 0 ? up / length(Vec3{up.x / radii.x, up.y / radii.y, up.z / radii.z})
                                  : height * up);
    }
    return out;
}

void Receivers::points(std::size_t packet, const Doubles& u, const Doubles& v, std::uint32_t of,
                       PatchPoints& out) const {
    const std::size_t first = packet * packet_size;
    out.count = std::min(order_.size() - first, std::size_t{packet_size});
    for (std::size_t i = 0; i < packet_size; ++i)
        out.patch[i] = order_[first + std::min(i, out.count - 1)];
    out.hits.clear();
    if (facets())
        facet_rays(u, v, of, out);
    else
        cell_rays(u, v, of, out);
    shape_.surface(out.view, out.hits, index_, out.surface);
    for (std::size_t i = 0; i < packet_size; ++i) {
        const auto lane = static_cast<int>(i);
        if (i >= out.count || out.hits.body[i] != index_) {
            out.area_m2[lane] = 0;
        } else if (!facets()) {
            const Vec3 p = out.surface.position.lane(lane);
            const double slant = -dot(out.surface.facet_normal.lane(lane), out.view.direction.lane(lane));
            out.area_m2[lane] = slant > 0 ? out.area_m2[lane] * dot(p, p) / slant : 0;
        }
    }
}

void Receivers::facet_rays(const Doubles& u, const Doubles& v, std::uint32_t of, PatchPoints& out) const {
    for (std::size_t i = 0; i < packet_size; ++i) {
        const auto lane = static_cast<int>(i);
        const Patch& patch = patches_[out.patch[i]];
        const TriangleCorners c = shape_.facets()->corners(static_cast<std::uint32_t>(out.patch[i]));
        // Uniform over the triangle: square root of u (Turk, Graphics Gems, 1990).
        const double root = std::sqrt(u[lane]);
        const double first = root * (1 - v[lane]), second = root * v[lane];
        const Vec3 p = c[0] + first * (c[1] - c[0]) + second * (c[2] - c[0]);
        const double back_m = std::sqrt(patch.area_m2);
        out.view.origin.set(lane, p + back_m * patch.normal);
        out.view.direction.set(lane, -patch.normal);
        out.view.t_max[lane] = no_hit;
        out.view.active.on[i] = -1;
        out.hits.t[lane] = back_m;
        out.hits.body[i] = index_;
        out.hits.primitive[i] = static_cast<std::uint32_t>(out.patch[i]);
        out.hits.u[i] = static_cast<float>(first);
        out.hits.v[i] = static_cast<float>(second);
        out.area_m2[lane] = patch.area_m2 / of;
    }
}

void Receivers::cell_rays(const Doubles& u, const Doubles& v, std::uint32_t of, PatchPoints& out) const {
    const double step = std::numbers::pi / static_cast<double>(rows_);
    for (std::size_t i = 0; i < packet_size; ++i) {
        const auto lane = static_cast<int>(i);
        const auto row = static_cast<double>(out.patch[i] / (2 * rows_));
        const auto column = static_cast<double>(out.patch[i] % (2 * rows_));
        const double north = std::cos(row * step), south = std::cos((row + 1) * step);
        const Vec3 up =
            radial(-std::numbers::pi + (column + u[lane]) * step, north + v[lane] * (south - north));
        out.view.origin.set(lane, radius_m_ * up);
        out.view.direction.set(lane, -up);
        out.view.t_max[lane] = no_hit;
        out.view.active.on[i] = -1;
        out.view.level_u[lane] = 0.5;
        out.area_m2[lane] = step * (north - south) / of; // solid angle
    }
    shape_.intersect(out.view, index_, out.hits);
}

std::size_t Receivers::patch_at(std::uint32_t primitive, Vec3 position_m) const {
    if (facets()) return primitive;
    const auto rows = static_cast<double>(rows_);
    const double colatitude = std::atan2(std::hypot(position_m.x, position_m.y), position_m.z);
    const double longitude = std::atan2(position_m.y, position_m.x) + std::numbers::pi;
    const auto row =
        static_cast<std::size_t>(std::clamp(colatitude / std::numbers::pi * rows, 0.0, rows - 0.5));
    const auto column =
        static_cast<std::size_t>(std::clamp(longitude / std::numbers::pi * rows, 0.0, 2 * rows - 0.5));
    return 2 * rows_ * row + column;
}

void Receivers::seeds(std::size_t packet, std::uint64_t seed, Draw what, Words& out) const {
    const std::size_t begin = packet * packet_size;
    for (std::size_t i = 0; i < packet_size; ++i) {
        const std::uint32_t patch = order_[std::min(begin + i, order_.size() - 1)];
        out.v[i] =
            seed_words(seed, patch, SamplePurpose::received_light, index_, 0)[static_cast<std::size_t>(what)];
    }
}

void draw(const Words& seeds, std::uint32_t number, std::uint32_t index, Doubles (&out)[4]) {
    Words own, indices;
    for (int i = 0; i < packet_size; ++i) {
        own[i] = seeds[i] + number * 0x9e3779b9U;
        indices[i] = index;
    }
    sobol_pair(indices, own, out[0], out[1]);
    sobol_second_pair(indices, own, out[2], out[3]);
}

} // namespace obscura::renderer
