// SPDX-License-Identifier: Apache-2.0
// Calls `timing` and `timing.rows`: time stamps of the newest frames, lateness of the rows of one.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "service/call.hpp"

namespace obscura::emulator {

/// Rows of the table of calls; `cameras` outlives them.
[[nodiscard]] service::Call timing_call(const CameraCalls::Cameras& cameras);
[[nodiscard]] service::Call timing_rows_call(const CameraCalls::Cameras& cameras);

} // namespace obscura::emulator
