// SPDX-License-Identifier: Apache-2.0
// [camera] of a scene file, and [camera.view] of a daemon that lays its own over it.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::scene {

/// Reads over `camera`: what is not given stays, and the whole place (position, attitude, motion, parent)
/// stays when nothing of it is given. `camera` outlives the section.
[[nodiscard]] config::Section camera_section(Camera& camera);

} // namespace obscura::scene
