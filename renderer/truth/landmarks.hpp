// SPDX-License-Identifier: Apache-2.0
// Points of landmarks in the frames of their bodies.
#pragma once

#include "renderer/world/row_state.hpp"

#include <vector>

namespace obscura::renderer {

/// Points of the scene's landmarks, body frame, in their order. Those given by longitude and latitude are
/// where the line from far outside to the origin first meets the surface. Throws ConfigError with the place
/// in the scene file where it meets none, or where there is no such body.
[[nodiscard]] std::vector<Vec3> landmark_points(const scene::Scene& scene,
                                                const std::vector<BuiltBody>& bodies);

} // namespace obscura::renderer
