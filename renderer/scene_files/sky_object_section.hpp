// SPDX-License-Identifier: Apache-2.0
// Tables [[sky_object]] of scene files.
#pragma once

#include "config/section.hpp"
#include "renderer/scene/sky_object.hpp"
#include "renderer/scene_files/scene_epoch.hpp"

#include <memory>
#include <vector>

namespace obscura::scene {

/// List of the tables; `epoch`: of the scene. `objects` are complete only if no mistake was found.
[[nodiscard]] config::List sky_object_list(const std::shared_ptr<std::vector<SkyObject>>& objects,
                                           const SharedEpoch& epoch);

} // namespace obscura::scene
