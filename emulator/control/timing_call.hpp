// SPDX-License-Identifier: Apache-2.0
// Call `timing`: time stamps of the newest frames.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "service/call.hpp"

namespace obscura::emulator {

/// The row; `cameras` outlives it.
[[nodiscard]] service::Call timing_call(const CameraCalls::Cameras& cameras);

} // namespace obscura::emulator
