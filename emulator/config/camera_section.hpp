// SPDX-License-Identifier: Apache-2.0
// [camera] and [[camera.window]]: reset values of the features that a client may change over GigE Vision.
#pragma once

#include "config/section.hpp"
#include "core/camera/camera.hpp"
#include "core/camera/setting_table.hpp"
#include "emulator/render/policies.hpp"
#include "sensors/description.hpp"

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// [[camera.window]]: one of several windows that are read in one frame, in their order.
struct WindowSection {
    std::int32_t width = 0, height = 0;
    std::int32_t offset_x = 0, offset_y = 0;
    double exposure_us = 0;
    Sampling sampling = Sampling::destructive;
    std::int32_t reads = 1;
};

/// [camera]
struct CameraSection {
    /// Extents of 0: the whole sensor. The exposure and the windows stand below.
    CameraSettings settings;
    double exposure_us = default_of(setting("ExposureTime"));
    std::optional<TriggerActivation> trigger_activation; ///< none: all edges that the line's source reports
    ReadoutTiming readout_timing = ReadoutTiming::sensor;
    std::int32_t rows_max = 0; ///< of composed images; 0: those that sensor and windows need
    /// Empty: one window by width, height and offsets.
    std::vector<WindowSection> windows;
};

/// The section with its own rules; those that need the sensor are in check_camera().
[[nodiscard]] config::Section section_of(CameraSection& section);

/// Key of [camera] that sets the SFNC feature `feature` after reset, as find_invalid() names it; with
/// `windows`, the list for features that [[camera.window]] sets. Empty if there is none.
[[nodiscard]] std::string_view key_of_feature(std::string_view feature, bool windows);

/// Checks windows and image against the sensor. `table` is the table of [camera].
void check_camera(const CameraSection& camera, const ReadoutSettings& readout,
                  const config::ReadTable& table);

/// The reset CameraSettings: `camera` on that sensor. The black level is the sensor's; triggers other than
/// FrameStart are off.
[[nodiscard]] CameraSettings camera_settings(const CameraSection& camera, const SensorDescription& sensor);

} // namespace obscura::emulator
