// SPDX-License-Identifier: Apache-2.0
// Calibration of a screen in front of a camera: from captures of the test patterns to the calibration table.
#pragma once

#include "transports/stimulator/calibration_table.hpp"
#include "transports/stimulator/patterns.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace obscura::transports {

/// Camera image of one pattern. Linear in light (no gamma), with any black level.
struct Capture {
    std::int32_t width = 0, height = 0;
    std::vector<float> pixels;
};

/// Settings of calibrate().
struct CalibrationSettings {
    std::int32_t camera_width = 0, camera_height = 0; ///< expected size of captures; 0: any
    double saturation = 65535;                        ///< digital number at which the camera saturates
    std::int32_t uniformity_step = 16;                ///< screen pixels between nodes of the uniformity map
    bool find_dead_pixels = true;
};

/// Quality figures of a calibration.
struct CalibrationReport {
    double seen_percent = 0;      ///< percentage of camera pixels that see the screen
    int finest_column_stripe = 0; ///< width of the finest stripes resolved, screen pixels
    int finest_row_stripe = 0;
    int dots_used = 0, dots_rejected = 0;
    double homography_rms_px = 0; ///< residual of the dots from the homography alone
    /// Residual of the dots from the smooth part of the map; the grid itself interpolates them.
    double residual_rms_px = 0;
    double camera_per_screen = 0; ///< camera pixels per screen pixel
    /// Luminance of level 0 relative to the highest; needs a dark capture.
    double black_to_white = 0;
    double uniformity_min = 1;
    bool dead_pixels_resolved = false;
};

/// Computes the table. `capture` returns the capture of the pattern with that name. The optional capture
/// "dark" (screen off) is subtracted to remove ambient light and the camera's offset; without it the black
/// level of the screen counts as no light. Throws InputError with one line: the unusable capture and the
/// reason.
[[nodiscard]] CalibrationTable calibrate(const PatternSequence& sequence,
                                         const std::function<const Capture*(const std::string&)>& capture,
                                         const CalibrationSettings& settings, CalibrationReport& report);

} // namespace obscura::transports
