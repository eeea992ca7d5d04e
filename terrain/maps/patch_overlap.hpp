// SPDX-License-Identifier: Apache-2.0
// Overlap of a map with those below it: points at which they are compared, and the width of the blend.
#pragma once

#include "terrain/geometry/map_frame.hpp"
#include "terrain/surface_domain.hpp"

#include <cstdint>
#include <vector>

namespace obscura::terrain {

/// Points of an overlap along each side that are compared at most.
inline constexpr std::int64_t max_compared_points = 512;

/// Point of the reference surface below a direction (planar: the point itself).
[[nodiscard]] Vec3 on_surface(const SurfaceDomain& domain, Vec3 direction);

/// Pixels from one compared point to the next, along columns and rows.
[[nodiscard]] std::int64_t compared_step(std::int64_t samples);
/// Points of the reference surface in the middles of a map's pixels, at most max_compared_points a side;
/// of a plane only those on it.
[[nodiscard]] std::vector<Vec3> compared_points(const SurfaceDomain& domain, const MapFrame& frame);

/// Edge of a pixel in the middle of a map, m.
[[nodiscard]] double pixel_size_m(const SurfaceDomain& domain, const MapFrame& frame);

/// Width of the blend at the edge where keys do not give it: 16 pixels of the map and at least 4 of those
/// below, at most a quarter of its shorter side.
[[nodiscard]] double default_feather_m(const SurfaceDomain& domain, const MapFrame& frame,
                                       double below_pixel_m);

/// 0 to 1 with slopes of 0 at both ends.
[[nodiscard]] double smoothstep(double t);

} // namespace obscura::terrain
