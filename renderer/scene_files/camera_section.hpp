// SPDX-License-Identifier: Apache-2.0
// Section [camera] of scene files, and [camera.view] of a daemon, which overrides it.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/scene_files/scene_epoch.hpp"

#include <memory>

namespace obscura::scene {

class KernelKeys;

/// Section that is read over `camera`: keys that are absent leave its values, and the whole place (position,
/// attitude, motion, parent) stays if none of its keys is given. `camera` must outlive the section. Files
/// with dates need the scene's `epoch`. Without `kernels` it has no keys that need them.
[[nodiscard]] config::Section camera_section(Camera& camera, SharedEpoch epoch = nullptr,
                                             const std::shared_ptr<KernelKeys>& kernels = nullptr);

} // namespace obscura::scene
