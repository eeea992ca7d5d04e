// SPDX-License-Identifier: Apache-2.0
// Section [[body]] of scene files: keys of every body, of its kind of shape and of its kind of material.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"

#include <memory>
#include <vector>

namespace obscura::scene {

class KernelKeys;

/// Reflectance factor of each body over wavelength; empty: the body has colours by band, or none.
using ColourCurves = std::vector<std::vector<SpectralPoint>>;

/// List of bodies that is read into `scene.bodies`, with one element of `curves` for each body. `scene` must
/// outlive the list. Files with dates need the epoch of `kernels`.
[[nodiscard]] config::List body_list(Scene& scene, std::shared_ptr<ColourCurves> curves,
                                     std::shared_ptr<KernelKeys> kernels);

} // namespace obscura::scene
