// SPDX-License-Identifier: Apache-2.0
// Call `scene.show` of a daemon: another scene for its cameras.
#pragma once

#include "emulator/control/scene_requests.hpp"
#include "service/call.hpp"

#include <filesystem>

namespace obscura::emulator {

/// The row; `requests` outlives it. Files are shipped scenes, or stand below `folder`.
[[nodiscard]] service::Call scene_call(SceneRequests& requests, const std::filesystem::path& folder);

} // namespace obscura::emulator
