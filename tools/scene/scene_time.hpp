// SPDX-License-Identifier: Apache-2.0
// Scene time from the text of an option: seconds, or an instant of a scene that has an epoch.
#pragma once

#include "renderer/scene/scene.hpp"

#include <string>

namespace obscura::tools {

/// Help of an option that takes such a text.
inline constexpr const char* scene_time_help =
    "Scene time in seconds; or, of a scene with an epoch, an instant such as 2026-03-01T12:00:00Z in any form that obscura time reads";

/// Scene time, s, that `text` says; `option` names it in messages, such as "obscura sky: --time". Throws
/// host::UsageError.
[[nodiscard]] double scene_time_of(const scene::Scene& scene, const std::string& text,
                                   const std::string& option);

} // namespace obscura::tools
