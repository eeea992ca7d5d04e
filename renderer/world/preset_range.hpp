// SPDX-License-Identifier: Apache-2.0
// Ranges of material presets: scenes that use a preset where its figures were not measured.
#pragma once

#include "renderer/scene/scene.hpp"
#include "renderer/world/view.hpp"

#include <string>
#include <vector>

namespace obscura::renderer {

/// One line for each body whose material is a preset outside its MaterialKind::range, without a full stop:
/// for the first band whose sunlight has its mean wavelength outside, and for a phase angle outside of a body
/// in the field. `view`: of `scene` at some instant. Bodies with a colour of their own are judged all the
/// same: their phase function is still that of the preset's wavelengths.
[[nodiscard]] std::vector<std::string> presets_out_of_range(const scene::Scene& scene, const View& view);

} // namespace obscura::renderer
