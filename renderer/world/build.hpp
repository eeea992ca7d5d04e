// SPDX-License-Identifier: Apache-2.0
// Builder of shapes, materials and textures from the description of a scene.
#pragma once

#include "renderer/lights/lighting.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/world/row_state.hpp"

#include <vector>

namespace obscura::renderer {

class ShapeCache;

/// Checks the numbers of a scene. Throws ConfigError with one line: place, value and what is allowed.
void validate(const scene::Scene& scene);

/// Loads meshes (one Embree scene per file, shared by the bodies that use it) and makes materials. The Sun,
/// unless its irradiance is 0, is the last body. `cache`: has shapes of the scene before, or null. Throws
/// InputError or ConfigError.
[[nodiscard]] std::vector<BuiltBody> build_bodies(const scene::Scene& scene, ShapeCache* cache = nullptr);

/// Gives the bodies that can shadow themselves an ElevationGuide, where it differs from cosine weights.
void guide_bounces(std::vector<BuiltBody>& bodies);

/// The emitting bodies whose area can be sampled.
[[nodiscard]] std::vector<AreaLight> area_lights_of(const std::vector<BuiltBody>& bodies);

} // namespace obscura::renderer
