// SPDX-License-Identifier: Apache-2.0
// Section [camera] of scene files, and [camera.view] of a daemon, which overrides it.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"

#include <memory>

namespace obscura::scene {

class KernelKeys;

/// Section that is read over `camera`: keys that are absent leave its values, and the whole place (position,
/// attitude, motion, parent) stays if none of its keys is given. `camera` must outlive the section.
/// `kernels`: of the scene, with its epoch.
[[nodiscard]] config::Section camera_section(Camera& camera, const std::shared_ptr<KernelKeys>& kernels);

} // namespace obscura::scene
