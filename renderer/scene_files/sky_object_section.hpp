// SPDX-License-Identifier: Apache-2.0
// Tables [[sky_object]] of scene files.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/sky_object.hpp"
#include "renderer/scene_files/kernel_keys.hpp"

#include <memory>
#include <vector>

namespace obscura::scene {

/// List of the tables; `kernels`: of the scene. `objects` are complete only if no mistake was found.
[[nodiscard]] config::List sky_object_list(const std::shared_ptr<std::vector<SkyObject>>& objects,
                                           const std::shared_ptr<KernelKeys>& kernels);

} // namespace obscura::scene
