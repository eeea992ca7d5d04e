// SPDX-License-Identifier: Apache-2.0
// A scene file as a section of keys: reading, checks and the reference are made from it.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::scene {

/// The root of a scene file with [sun], [stars], [camera], [[body]], [[lamp]], [[band]], [[stray_light]].
/// `scene` has its defaults and outlives the section; it is not complete unless no mistake was found.
[[nodiscard]] config::Section scene_section(Scene& scene);

} // namespace obscura::scene
