// SPDX-License-Identifier: Apache-2.0
// [[body]] of a scene file: the keys of every body, and those of its kinds of shape and material.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"

#include <memory>
#include <vector>

namespace obscura::scene {

/// Reflectance of each body over wavelength; empty: the body has colours band by band, or none.
using ColourCurves = std::vector<std::vector<SpectralPoint>>;

/// Reads into `scene.bodies`, and gives `curves` one element for each body. `scene` outlives the list.
[[nodiscard]] config::List body_list(Scene& scene, std::shared_ptr<ColourCurves> curves);

} // namespace obscura::scene
