// SPDX-License-Identifier: Apache-2.0
// Settings and limits of a configured camera after reset.
#pragma once

#include "core/camera/camera.hpp"
#include "emulator/config/daemon_config.hpp"

#include <cstddef>
#include <cstdint>

namespace obscura::emulator {

/// Settings of a camera after reset, and the limits of what clients may set.
struct InitialCamera {
    CameraSettings settings;
    CameraLimits limits;
};

/// The camera of `config`, whose window settings check_camera() has found valid. Other settings may lie
/// outside of the limits, see find_invalid().
[[nodiscard]] InitialCamera initial_camera(const DaemonConfig& config);

/// Limits of the camera settings with `sensor`. `rows_max`: rows of composed images; 0: those of the sensor.
[[nodiscard]] CameraLimits camera_limits(const SensorDescription& sensor, std::int32_t rows_max = 0);

/// Line that triggers frames after reset; Line0 if none does.
[[nodiscard]] std::size_t initial_trigger_line(const DaemonConfig& config);

} // namespace obscura::emulator
