// SPDX-License-Identifier: Apache-2.0
// Calls `frame` and `stream`: frames of a running camera as arrays.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "service/call.hpp"

namespace obscura::emulator {

/// The rows; `cameras` outlives them.
[[nodiscard]] service::Call frame_call(const CameraCalls::Cameras& cameras);
[[nodiscard]] service::Call stream_call(const CameraCalls::Cameras& cameras);

} // namespace obscura::emulator
