// From captures of the calibration patterns to the table that the optical stage works with.
#pragma once

#include "transports/stimulator/calibration_table.hpp"
#include "transports/stimulator/patterns.hpp"

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace obscura::transports {

/// What the camera saw of one pattern. Linear in light: no gamma, black level may be anything.
struct Capture {
    std::int32_t width = 0, height = 0;
    std::vector<float> pixels;
};

/// What calibrate() needs to know besides the captures.
struct CalibrationSettings {
    std::int32_t camera_width = 0, camera_height = 0; ///< 0: as captured
    double saturation = 65535;                        ///< digital number at which the camera saturates
    std::int32_t uniformity_step = 16;                ///< screen pixels between nodes of the uniformity map
    bool find_dead_pixels = true;
};

/// What was found out besides the table, for the reader.
struct CalibrationReport {
    double seen_percent = 0;      ///< share of the camera that sees the screen
    int finest_column_stripe = 0; ///< screen pixels; stripes finer than that were not resolved
    int finest_row_stripe = 0;
    int dots_used = 0, dots_rejected = 0;
    double homography_rms_px = 0; ///< dots about the homography alone
    double residual_rms_px = 0;   ///< dots about the smooth part of map; the grid itself goes through them
    double camera_per_screen = 0; ///< camera pixels per screen pixel
    double black_to_white = 0;    ///< luminance of level 0 relative to the highest, with a dark capture only
    double uniformity_min = 1;
    bool dead_pixels_resolved = false;
};

/// Works out the table. `capture` returns the capture of the pattern with that name; an optional one of name
/// "dark" (screen off) takes ambient light and the camera's offset away, without it the black level of the
/// screen counts as no light. Throws InputError with one line that says which capture is not usable and why.
[[nodiscard]] CalibrationTable calibrate(const PatternSequence& sequence,
                                         const std::function<const Capture*(const std::string&)>& capture,
                                         const CalibrationSettings& settings, CalibrationReport& report);

} // namespace obscura::transports
