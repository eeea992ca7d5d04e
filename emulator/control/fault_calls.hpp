// SPDX-License-Identifier: Apache-2.0
// Calls `faults.list` and `faults.set`: injected faults of a running camera.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "service/call.hpp"

namespace obscura::emulator {

/// The rows; `cameras` outlives them. Faults belong to who runs the camera, not to the client that controls
/// it: they change under its eyes.
[[nodiscard]] service::Calls fault_calls(const CameraCalls::Cameras& cameras);

} // namespace obscura::emulator
