// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/patch_overlap.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::terrain {
namespace {

double metres_per_radian(const SurfaceDomain& domain, Vec3 p) {
    return domain.is_plane() ? 1 : length(p);
}

Vec3 middle_of(const MapFrame& frame) {
    return frame.position({static_cast<double>(frame.width()) / 2, static_cast<double>(frame.height()) / 2});
}

/// Shorter side of a raster, m, through its middle.
double shorter_side_m(const SurfaceDomain& domain, const MapFrame& frame) {
    const auto width = static_cast<double>(frame.width()), height = static_cast<double>(frame.height());
    const Vec3 middle = middle_of(frame);
    const SamplePlace density = frame.samples_per_radian(middle);
    const double metres = metres_per_radian(domain, on_surface(domain, middle));
    const double across = frame.period() > 0 ? std::numeric_limits<double>::infinity() : width / density.x;
    return metres * std::min(across, height / density.y);
}

} // namespace

Vec3 on_surface(const SurfaceDomain& domain, Vec3 direction) {
    if (domain.is_plane()) return direction;
    const Vec3 radii = domain.radii_m();
    const Vec3 scaled{direction.x / radii.x, direction.y / radii.y, direction.z / radii.z};
    return direction / length(scaled);
}

std::int64_t compared_step(std::int64_t samples) {
    return (samples + max_compared_points - 1) / max_compared_points;
}

std::vector<Vec3> compared_points(const SurfaceDomain& domain, const MapFrame& frame) {
    std::vector<Vec3> positions;
    const std::int64_t step_x = compared_step(frame.width()), step_y = compared_step(frame.height());
    for (std::int64_t j = step_y / 2; j < frame.height(); j += step_y)
        for (std::int64_t i = step_x / 2; i < frame.width(); i += step_x) {
            const Vec3 p =
                on_surface(domain, frame.position({static_cast<double>(i), static_cast<double>(j)}));
            if (domain.is_plane() && std::max(std::abs(p.x), std::abs(p.y)) > domain.half_edge_m()) continue;
            positions.push_back(p);
        }
    return positions;
}

double pixel_size_m(const SurfaceDomain& domain, const MapFrame& frame) {
    const Vec3 middle = middle_of(frame);
    const SamplePlace density = frame.samples_per_radian(middle);
    return metres_per_radian(domain, on_surface(domain, middle)) / std::min(density.x, density.y);
}

double default_feather_m(const SurfaceDomain& domain, const MapFrame& frame, double below_pixel_m) {
    return std::min(std::max(16 * pixel_size_m(domain, frame), 4 * below_pixel_m),
                    0.25 * shorter_side_m(domain, frame));
}

double smoothstep(double t) {
    const double s = std::clamp(t, 0.0, 1.0);
    return s * s * (3 - 2 * s);
}

} // namespace obscura::terrain
