// SPDX-License-Identifier: Apache-2.0
// Intersection of a single ray with a shape.
#pragma once

#include "renderer/shapes/shape.hpp"

namespace obscura::renderer {

/// Distance along the unit vector `direction` from `origin`, body frame, to the surface; no_hit: none.
[[nodiscard]] double distance_along(const Shape& shape, Vec3 origin, Vec3 direction);

} // namespace obscura::renderer
