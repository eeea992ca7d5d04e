// SPDX-License-Identifier: Apache-2.0
// Material presets: parameters of real surfaces from papers and handbooks.
#pragma once

#include "core/spectral_band.hpp"
#include "renderer/scene/scene.hpp"

#include <vector>

namespace obscura::renderer {

// One function for each preset. Its comment in presets.cpp gives the source and says what is typical rather
// than measured.
[[nodiscard]] scene::Material moon();
[[nodiscard]] scene::Material eros();
[[nodiscard]] scene::Material itokawa();
[[nodiscard]] scene::Material comet_67p();
[[nodiscard]] scene::Material mli();
[[nodiscard]] scene::Material solar_cell();
[[nodiscard]] scene::Material white_paint();

/// Reflectance of S-class asteroids over wavelength, relative to that at 550 nm.
[[nodiscard]] std::vector<SpectralPoint> s_class_curve();

} // namespace obscura::renderer
