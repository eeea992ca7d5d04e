// SPDX-License-Identifier: Apache-2.0
// Root section of scene files, from which reading, checks and the reference are made.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::scene {

/// Root section with [sun], [stars], [camera], [[body]], [[lamp]], [[band]], [[stray_light]]. `scene` has its
/// defaults and must outlive the section; it is complete only if no mistake was found.
[[nodiscard]] config::Section scene_section(Scene& scene);

} // namespace obscura::scene
