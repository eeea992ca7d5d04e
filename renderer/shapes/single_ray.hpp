// SPDX-License-Identifier: Apache-2.0
// Intersection of a single ray with a shape.
#pragma once

#include "renderer/shapes/shape.hpp"

#include <span>

namespace obscura::renderer {

/// Distance along the unit vector `direction` from `origin`, body frame, to the surface; no_hit: none.
[[nodiscard]] double distance_along(const Shape& shape, Vec3 origin, Vec3 direction);

/// Distances along unit vectors from one origin, in packets.
void distances_along(const Shape& shape, Vec3 origin, std::span<const Vec3> directions,
                     std::span<double> distances);

} // namespace obscura::renderer
