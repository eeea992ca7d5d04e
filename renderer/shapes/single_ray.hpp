// SPDX-License-Identifier: Apache-2.0
// Intersection of a single ray with a shape.
#pragma once

#include "renderer/shapes/shape.hpp"

#include <span>

namespace obscura::renderer {

/// Distance along the unit vector `direction` from `origin`, body frame, to the surface; no_hit: none.
/// `detail`: of terrain, in the middle of its levels; null: see TerrainShape.
[[nodiscard]] double distance_along(const Shape& shape, Vec3 origin, Vec3 direction,
                                    const DetailView* detail = nullptr);

/// Distances along unit vectors, each from its own origin, in packets.
void distances_along(const Shape& shape, std::span<const Vec3> origins, std::span<const Vec3> directions,
                     std::span<double> distances, const DetailView* detail = nullptr);

/// Distances along unit vectors from one origin, in packets.
void distances_along(const Shape& shape, Vec3 origin, std::span<const Vec3> directions,
                     std::span<double> distances, const DetailView* detail = nullptr);

} // namespace obscura::renderer
