// SPDX-License-Identifier: Apache-2.0
// Calls `probe` and `irradiance`: one pixel of a frame in digital numbers, electrons and irradiance, and what
// it shows; irradiance of all pixels.
#pragma once

#include "emulator/control/camera_calls.hpp"
#include "emulator/control/pixel_probes.hpp"
#include "emulator/unit/camera_unit.hpp"
#include "service/call.hpp"

#include <cstddef>
#include <functional>

namespace obscura::emulator {

/// CameraUnit::probe_source() of a camera of that number. Throws Failure.
using ProbeSourceOf = std::function<CameraUnit::ProbeSource(std::size_t camera, const FrameInfo& frame)>;

/// The row; `cameras` and `probes` outlive it.
[[nodiscard]] service::Call probe_call(const CameraCalls::Cameras& cameras, PixelProbes& probes,
                                       ProbeSourceOf source);
[[nodiscard]] service::Call irradiance_call(const CameraCalls::Cameras& cameras, PixelProbes& probes,
                                            ProbeSourceOf source);

} // namespace obscura::emulator
