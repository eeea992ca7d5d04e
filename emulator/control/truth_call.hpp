// SPDX-License-Identifier: Apache-2.0
// Call `truth`: where bodies, limbs, stars, windows and hot pixels are in a frame of a running camera.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "service/call.hpp"

namespace obscura::emulator {

/// The row; `cameras` outlives it.
[[nodiscard]] service::Call truth_call(const CameraCalls::Cameras& cameras);

} // namespace obscura::emulator
