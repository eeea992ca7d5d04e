// SPDX-License-Identifier: Apache-2.0
// Calls `frame` and `stream`: frames of a running camera as arrays.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "service/call.hpp"

#include <nlohmann/json.hpp>

#include <vector>

namespace obscura::emulator {

/// What the calls tell of a frame, besides its place in the series.
[[nodiscard]] nlohmann::json frame_head(const FrameInfo& info);
/// Rows of the reference for that.
[[nodiscard]] std::vector<service::Result> frame_head_results();

/// The rows; `cameras` outlives them.
[[nodiscard]] service::Call frame_call(const CameraCalls::Cameras& cameras);
[[nodiscard]] service::Call stream_call(const CameraCalls::Cameras& cameras);

} // namespace obscura::emulator
