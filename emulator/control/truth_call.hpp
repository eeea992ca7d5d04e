// SPDX-License-Identifier: Apache-2.0
// Call `truth`: where bodies are in the newest frame of a running camera.
#pragma once

#include "emulator/body_positions.hpp"
#include "emulator/control/camera_calls.hpp"
#include "service/call.hpp"

#include <cstddef>
#include <functional>
#include <vector>

namespace obscura::emulator {

/// Positions in a frame of a camera of that number. Throws Failure.
using PositionsOf = std::function<std::vector<BodyPosition>(std::size_t camera, const FrameInfo& frame)>;

/// The row; `cameras` outlives it.
[[nodiscard]] service::Call truth_call(const CameraCalls::Cameras& cameras, PositionsOf positions);

} // namespace obscura::emulator
