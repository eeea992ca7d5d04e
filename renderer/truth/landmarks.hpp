// SPDX-License-Identifier: Apache-2.0
// Points of landmarks in the frames of their bodies.
#pragma once

#include "renderer/planets/ground.hpp"
#include "renderer/world/row_state.hpp"

#include <optional>
#include <vector>

namespace obscura::renderer {

/// Semi-axes of the ellipsoid from which heights of a body of that shape count; none: the shape has none.
[[nodiscard]] std::optional<Vec3> reference_radii_m(const scene::Shape& shape);

/// Point of a landmark in the frame of its body, of that shape: its own position, or the outermost surface
/// along the line of its longitude and latitude. Throws ConfigError.
[[nodiscard]] Vec3 landmark_point(const scene::Landmark& landmark, const scene::Shape& description,
                                  const Shape& shape, GroundDetail detail);

/// Points of the scene's landmarks, body frame, in their order. Those given by longitude and latitude are
/// where the line from far outside to the origin first meets the surface. Throws ConfigError with the place
/// in the scene file where it meets none, or where there is no such body.
[[nodiscard]] std::vector<Vec3> landmark_points(const scene::Scene& scene,
                                                const std::vector<BuiltBody>& bodies);

} // namespace obscura::renderer
