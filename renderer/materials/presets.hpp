// SPDX-License-Identifier: Apache-2.0
// Real surfaces by name: the parameters that papers and handbooks give for them.
#pragma once

#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

// One function for each; the source and what is typical rather than measured stands with its figures.
[[nodiscard]] scene::Material moon();
[[nodiscard]] scene::Material eros();
[[nodiscard]] scene::Material itokawa();
[[nodiscard]] scene::Material comet_67p();
[[nodiscard]] scene::Material mli();
[[nodiscard]] scene::Material solar_cell();
[[nodiscard]] scene::Material white_paint();

} // namespace obscura::renderer
