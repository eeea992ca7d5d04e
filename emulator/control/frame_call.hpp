// SPDX-License-Identifier: Apache-2.0
// Call `frame`: the newest frame of a running camera as an array.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "service/call.hpp"

namespace obscura::emulator {

/// The row; `cameras` outlives it.
[[nodiscard]] service::Call frame_call(const CameraCalls::Cameras& cameras);

} // namespace obscura::emulator
