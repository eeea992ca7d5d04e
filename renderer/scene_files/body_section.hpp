// SPDX-License-Identifier: Apache-2.0
// Section [[body]] of scene files: keys of every body, of its kind of shape and of its kind of material.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/scene_files/scene_epoch.hpp"

#include <memory>
#include <vector>

namespace obscura::scene {

/// Reflectance factor of each body over wavelength; empty: the body has colours by band, or none.
using ColourCurves = std::vector<std::vector<SpectralPoint>>;

/// List of bodies that is read into `scene.bodies`, with one element of `curves` for each body. `scene` must
/// outlive the list. Files with dates need the scene's `epoch`.
[[nodiscard]] config::List body_list(Scene& scene, std::shared_ptr<ColourCurves> curves, SharedEpoch epoch);

} // namespace obscura::scene
