// SPDX-License-Identifier: Apache-2.0
// Light that a body emits by itself: of its keys, or by emission() of its law.
#pragma once

#include "models/kinds/material_program.hpp"
#include "renderer/scene/scene.hpp"

#include <cstddef>
#include <memory>
#include <vector>

namespace obscura::renderer {

/// Light that a body emits by itself.
struct OwnLight {
    std::vector<double> radiance_w_m2_sr; ///< in each band, of which textures give a factor; empty: none
    /// emission() of the body's law where it varies: the factor on `radiance_w_m2_sr`, which is 1.
    std::shared_ptr<const models::MaterialProgram> law;
    bool uniform = true; ///< over the body, and in all directions
};

/// `material`: that of the body, with bands and globals of the scene. Throws ConfigError.
[[nodiscard]] OwnLight own_light(const scene::Body& body, const scene::Material& material, std::size_t bands);

/// An area light is uniform; other light is found by the paths that hit it.
[[nodiscard]] inline bool is_area_light(const OwnLight& light) {
    return !light.radiance_w_m2_sr.empty() && light.uniform;
}

} // namespace obscura::renderer
