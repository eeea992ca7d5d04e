// SPDX-License-Identifier: Apache-2.0
// Material presets: parameters of real surfaces from papers and handbooks.
#pragma once

#include "renderer/scene/scene.hpp"

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

} // namespace obscura::renderer
