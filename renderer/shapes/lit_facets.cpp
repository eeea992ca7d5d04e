// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/lit_facets.hpp"

#include "renderer/packets/packet.hpp"
#include "renderer/shapes/shape.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <utility>

namespace obscura::renderer {
namespace {

/// Steps of LitFacets::Directions in a unit.
constexpr double steps = 512;
/// Largest angle between a direction and its rounded one, rad.
constexpr double rounding = 0.87 / steps;
/// Unit of the components of FacetSet::Facet::normals.
constexpr double normal_unit = 1.0 / 32767;
/// Weight of the inner side of a closed surface, which is seen only where parts of it are inside out.
constexpr double inner_weight = 0.05;
/// Weight of what is not sunlight, as a cosine.
constexpr double other_light_weight = 0.1;
/// Cells of equal weight, rays that test each one, and the least share of samples of a cell in that of one
/// that is seen whole.
constexpr std::size_t cells = 8192;
constexpr int tests_per_cell = 4;
constexpr double min_share = 0.1;
/// Cells are tested if the cosine of the phase angle is less.
constexpr double tested_cos_phase = 0.5;
/// Largest number of facets in all lists that are kept.
constexpr std::size_t max_stored = 1u << 22;

std::uint64_t mix_hash(std::uint64_t x) {
    // SplitMix64: Steele, Lea and Flood, OOPSLA 2014.
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ x >> 30) * 0xbf58476d1ce4e5b9u;
    x = (x ^ x >> 27) * 0x94d049bb133111ebu;
    return x ^ x >> 31;
}

std::uint64_t hash(Vec3 p) {
    // Adding 0 makes -0 the same corner as 0.
    const auto bits = [](double a) { return std::bit_cast<std::uint64_t>(a + 0.0); };
    return mix_hash(mix_hash(mix_hash(bits(p.x)) ^ bits(p.y)) ^ bits(p.z));
}

/// Every third bit of a number of 21 bits.
std::uint64_t spread_bits(std::uint64_t x) {
    x = (x | x << 32) & 0x001f00000000ffffu;
    x = (x | x << 16) & 0x001f0000ff0000ffu;
    x = (x | x << 8) & 0x100f00f00f00f00fu;
    x = (x | x << 4) & 0x10c30c30c30c30c3u;
    return (x | x << 2) & 0x1249249249249249u;
}

/// Largest max(0, x) for x within `slack` of c: no light exceeds its weight by much.
double most(double c, double slack) {
    return std::max(0.0, c + slack);
}

Vec3 from_steps(const std::array<std::int32_t, 3>& a) {
    return Vec3{static_cast<double>(a[0]), static_cast<double>(a[1]), static_cast<double>(a[2])} / steps;
}

std::array<std::int32_t, 3> to_steps(Vec3 a) {
    const double scale = steps / length(a);
    return {static_cast<std::int32_t>(std::lround(a.x * scale)),
            static_cast<std::int32_t>(std::lround(a.y * scale)),
            static_cast<std::int32_t>(std::lround(a.z * scale))};
}

} // namespace

LitFacets::LitFacets(const FacetSet& set, const Directions& directions) : set_(set) {
    const Vec3 camera = from_steps(directions.camera);
    const Vec3 sun = from_steps(directions.sun);
    const double camera_slack = directions.camera_slack / steps + rounding;
    const double sun_slack = directions.sun_slack / steps + rounding + 2 * normal_unit;
    const double min_light = directions.other_light ? other_light_weight : 0;
    const double inner = set.closed() ? inner_weight : 1;
    listed_.assign(set.triangle_count() / 64 + 1, 0);
    double sum = 0;
    for (const FacetSet::Facet& f : set.facets()) {
        const double ax = f.area_x;
        const double ay = f.area_y;
        const double az = f.area_z;
        const double area = std::sqrt(ax * ax + ay * ay + az * az);
        const double seen = ax * camera.x + ay * camera.y + az * camera.z;
        // Light on one side: where normals are interpolated, no point has three times this.
        const auto side = [&](double facing) {
            const double out = most(facing * seen, camera_slack * area);
            if (!(out > 0)) return 0.0;
            double light = 0;
            for (const auto& n : f.normals)
                light += most(facing * (n[0] * sun.x + n[1] * sun.y + n[2] * sun.z) * normal_unit, sun_slack);
            return light > 0 ? out * (light / 3 + min_light) : 0.0;
        };
        const double weight = side(1) + inner * side(-1);
        if (!(weight > 0)) continue;
        sum += weight;
        sums_.push_back(sum);
        triangles_.push_back(f.triangle);
        listed_[f.triangle / 64] |= std::uint64_t{1} << (f.triangle % 64);
    }
    // Seen from the Sun's side little is in shadow.
    if (!sums_.empty() && set.shape().shadows_itself() && dot(camera, sun) < tested_cos_phase)
        test_cells(normalized(camera), normalized(sun), sun_slack);
}

void LitFacets::test_cells(Vec3 camera, Vec3 sun, double sun_slack) {
    Vec3 sun_x;
    Vec3 sun_y;
    orthonormal_basis(sun, sun_x, sun_y);
    constexpr int cells_at_once = packet_size / tests_per_cell;
    std::array<double, cells> seen{};
    std::size_t facet = 0;
    std::uint64_t word = 0;
    const auto random = [&word] { return static_cast<double>(mix_hash(++word) >> 11) * 0x1p-53; };
    for (std::size_t first = 0; first < cells; first += cells_at_once) {
        RayPacket rays;
        Vec3s to_sun;
        for (int i = 0; i < packet_size; ++i) {
            const std::size_t test = first * tests_per_cell + static_cast<std::size_t>(i);
            const double u = (static_cast<double>(test) + random()) / (cells * tests_per_cell);
            const Point p = sample_weights(u, random(), facet);
            const auto [a, b, c] = set_.corners(p.triangle);
            const Vec3 area = cross(b - a, c - a);
            const double twice_m2 = length(area);
            // Clear of the facet by some of its size: the light of interpolated normals passes there.
            const Vec3 lift = area * ((dot(area, camera) < 0 ? -0.3 : 0.3) / std::sqrt(twice_m2));
            rays.origin.set(i, p.position_m + lift);
            rays.direction.set(i, camera);
            rays.t_max[i] = no_hit;
            rays.active.on[i] = -1;
            const double turn = 2 * std::numbers::pi * random();
            const double off = sun_slack * std::sqrt(random());
            to_sun.set(i, normalized(sun + (sun_x * std::cos(turn) + sun_y * std::sin(turn)) * off));
        }
        set_.shape().occlude(rays);
        if (!rays.active.any()) continue;
        rays.direction = to_sun;
        set_.shape().occlude(rays);
        for (int i = 0; i < packet_size; ++i)
            if (rays.active.on[i] != 0) seen[first + static_cast<std::size_t>(i / tests_per_cell)] += 1;
    }
    // The best share is the root of what is seen of a cell (least variance); neighbours take part, so that
    // few tests do not miss much.
    double sum = 0;
    for (std::size_t k = 0; k < cells; ++k) {
        constexpr std::array<double, 5> kernel{1, 2, 4, 2, 1};
        double mean = 0;
        for (std::size_t j = 0; j < kernel.size(); ++j)
            mean += kernel[j] * seen[(k + j + cells - 2) % cells] / (10.0 * tests_per_cell);
        sum += std::max(std::sqrt(mean), min_share);
        cells_.push_back(sum);
    }
}

LitFacets::Point LitFacets::sample(double u, double v, Cursor& cursor) const {
    if (cells_.empty()) return sample_weights(u, v, cursor.facet);
    const double at = u * cells_.back();
    cursor.cell = static_cast<std::size_t>(
        std::upper_bound(cells_.begin() + static_cast<std::ptrdiff_t>(cursor.cell), cells_.end() - 1, at) -
        cells_.begin());
    const double before = cursor.cell > 0 ? cells_[cursor.cell - 1] : 0;
    const double share = cells_[cursor.cell] - before;
    const double within = std::clamp((at - before) / share, 0.0, 1.0);
    Point point = sample_weights((static_cast<double>(cursor.cell) + within) / cells, v, cursor.facet);
    point.area_m2 = point.area_m2 * (cells_.back() / (share * cells));
    return point;
}

LitFacets::Point LitFacets::sample_weights(double u, double v, std::size_t& facet) const {
    const double at = u * sums_.back();
    facet = static_cast<std::size_t>(
        std::upper_bound(sums_.begin() + static_cast<std::ptrdiff_t>(facet), sums_.end() - 1, at) -
        sums_.begin());
    const double before = facet > 0 ? sums_[facet - 1] : 0;
    const double weight = sums_[facet] - before;
    const auto [a, b, c] = set_.corners(triangles_[facet]);
    const double root = std::sqrt(std::clamp((at - before) / weight, 0.0, 1.0));
    return {a + (b - a) * (root * (1 - v)) + (c - a) * (root * v),
            cross(b - a, c - a) * (sums_.back() / weight / 2), triangles_[facet]};
}

FacetSet::FacetSet(const Shape& shape, std::uint32_t triangles, Corners corners, const Corners& normals)
    : shape_(shape), corners_(std::move(corners)), triangle_count_(triangles) {
    struct Place {
        std::uint64_t code;
        std::uint32_t triangle;
    };
    std::vector<Place> places(triangles);
    double volume = 0;
    std::uint64_t edges = 0; // sum of the hashes of all directed edges, less those of their opposites
    for (std::uint32_t i = 0; i < triangles; ++i) {
        const TriangleCorners t = corners_(i);
        for (const Vec3 p : t)
            radius_m_ = std::max(radius_m_, length(p));
        volume += dot(t[0], cross(t[1], t[2]));
        const std::array<std::uint64_t, 3> h{hash(t[0]), hash(t[1]), hash(t[2])};
        for (std::size_t k = 0; k < 3; ++k) {
            const std::uint64_t from = h[k];
            const std::uint64_t to = h[(k + 1) % 3];
            if (from != to) edges += mix_hash(mix_hash(from) + to) - mix_hash(mix_hash(to) + from);
        }
    }
    closed_ = edges == 0 && volume > 0;
    for (std::uint32_t i = 0; i < triangles; ++i) {
        const TriangleCorners t = corners_(i);
        const Vec3 middle = (t[0] + t[1] + t[2]) / 3;
        const auto code = [&](double x) {
            return spread_bits(static_cast<std::uint64_t>((x / radius_m_ + 1) * 0x0fffff));
        };
        places[i] = {code(middle.x) | code(middle.y) << 1 | code(middle.z) << 2, i};
    }
    std::sort(places.begin(), places.end(), [](const Place& a, const Place& b) {
        return a.code != b.code ? a.code < b.code : a.triangle < b.triangle;
    });
    facets_.reserve(triangles);
    for (const Place& place : places) {
        const TriangleCorners t = corners_(place.triangle);
        const Vec3 area = cross(t[1] - t[0], t[2] - t[0]) / 2;
        if (!(length(area) > 0)) continue;
        const TriangleCorners n = normals ? normals(place.triangle) : TriangleCorners{};
        const auto narrow = [](double a) { return static_cast<float>(a); };
        Facet facet{narrow(area.x), narrow(area.y), narrow(area.z), place.triangle, {}};
        for (std::size_t k = 0; k < 3; ++k) {
            const Vec3 unit = normalized(length(n[k]) > 1e-6 ? n[k] : area);
            const auto number = [](double a) {
                return static_cast<std::int16_t>(std::lround(a / normal_unit));
            };
            facet.normals[k] = {number(unit.x), number(unit.y), number(unit.z)};
        }
        facets_.push_back(facet);
    }
}

std::shared_ptr<const LitFacets> FacetSet::lit(Vec3 camera_m, Vec3 sun_m, double sun_radius_m,
                                               bool other_light) const {
    const auto slack = [](double reach_m, double distance_m) {
        return static_cast<std::int32_t>(std::ceil(steps * std::min(1.0, reach_m / distance_m)));
    };
    const LitFacets::Directions directions{to_steps(camera_m), to_steps(sun_m),
                                           slack(radius_m_, length(camera_m)),
                                           slack(radius_m_ + sun_radius_m, length(sun_m)), other_light};
    const std::lock_guard lock(mutex_);
    ++calls_;
    for (Kept& k : kept_)
        if (k.directions == directions) {
            k.used = calls_;
            return k.list;
        }
    std::size_t facets = 0;
    for (const Kept& k : kept_)
        facets += k.list->size();
    while (!kept_.empty() && facets > max_stored) {
        const auto oldest = std::min_element(kept_.begin(), kept_.end(),
                                             [](const Kept& a, const Kept& b) { return a.used < b.used; });
        facets -= oldest->list->size();
        kept_.erase(oldest);
    }
    kept_.push_back({directions, std::make_shared<const LitFacets>(*this, directions), calls_});
    return kept_.back().list;
}

} // namespace obscura::renderer
