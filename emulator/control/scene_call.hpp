// SPDX-License-Identifier: Apache-2.0
// Calls `scene.show` and `scene.list` of a daemon: the scene of its cameras.
#pragma once

#include "emulator/control/scene_requests.hpp"
#include "service/call.hpp"

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Names by which scenes can be shown: those of shipped scenes, then files below `folder` as seen from there.
/// Files that are no TOML, or have other tables than a scene may have, are left out, and so are those more
/// than three folders down; at most 1000.
[[nodiscard]] std::vector<std::string> scene_names(const std::filesystem::path& folder);

/// Why each of these files cannot be shown in place of the present scene, in one line; empty: it can.
using ScenesRefused =
    std::function<std::vector<std::string>(const std::vector<std::filesystem::path>& files)>;

/// The rows; `requests` outlives them. Files are shipped scenes, or stand below `folder`. `shown` gives the
/// file of the scene that is shown.
[[nodiscard]] service::Calls scene_calls(SceneRequests& requests, const std::filesystem::path& folder,
                                         std::function<std::filesystem::path()> shown, ScenesRefused refused);

} // namespace obscura::emulator
