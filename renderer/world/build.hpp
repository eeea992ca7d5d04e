// SPDX-License-Identifier: Apache-2.0
// From the scene's description to shapes and materials.
#pragma once

#include "renderer/lights/lighting.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/world/row_state.hpp"

#include <vector>

namespace obscura::renderer {

/// Throws ConfigError when a number of the scene cannot be used: one line that says where and what is
/// allowed.
void validate(const scene::Scene& scene);

/// Loads the meshes (one Embree scene per file, shared by the bodies that use it) and makes the materials;
/// the Sun, unless its irradiance is 0, is the last body. Throws InputError or ConfigError.
[[nodiscard]] std::vector<BuiltBody> build_bodies(const scene::Scene& scene);

/// The bodies that emit and whose area can be sampled.
[[nodiscard]] std::vector<AreaLight> area_lights_of(const std::vector<BuiltBody>& bodies);

} // namespace obscura::renderer
