// SPDX-License-Identifier: Apache-2.0
// Calls to the features of a camera's control protocol: user sets, counters, lines, sequencer and the like.
#pragma once

#include "emulator/control/camera_calls.hpp"

namespace obscura::emulator {

/// The calls "device.features" and "device.set". `cameras` outlives them.
[[nodiscard]] service::Calls device_calls(const CameraCalls::Cameras& cameras);

} // namespace obscura::emulator
