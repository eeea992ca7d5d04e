// SPDX-License-Identifier: Apache-2.0
// Calibration table of one screen in front of one camera, and its FITS file.
#pragma once

#include "transports/stimulator/radiometric_curve.hpp"
#include "transports/stimulator/screen_map.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::transports {

/// Relative response of the camera to each point of the screen, the maximum being 1: non-uniformity of the
/// screen times vignetting. Nodes of a regular grid, bilinear between them, constant outside. Empty: 1
/// everywhere.
struct UniformityGrid {
    int columns = 0, rows = 0;
    double x0 = 0, y0 = 0, step = 1; ///< as in DistortionGrid
    std::vector<float> values;

    [[nodiscard]] double operator()(PixelPoint p) const;
};

/// Integer coordinates of a screen pixel.
struct ScreenPixel {
    std::int32_t x = 0, y = 0;
    bool operator==(const ScreenPixel&) const = default;
};

/// Geometric and radiometric calibration used by the optical stage.
struct CalibrationTable {
    std::int32_t screen_width = 0, screen_height = 0;
    std::int32_t camera_width = 0, camera_height = 0;
    std::int32_t levels = 256; ///< drive levels of the curve
    ScreenMap map;
    std::vector<CurvePoint> curve; ///< empty: linear
    UniformityGrid uniformity;
    std::vector<ScreenPixel> dead; ///< pixels whose light does not follow their drive level
    /// RMS residual of the dots from the map, camera pixels; informative.
    double residual_px = 0;
};

/// Writes `table` as FITS: an empty primary with the sizes in its header and one extension each for
/// HOMOGRAPHY, DISTORTION, CURVE, UNIFORMITY and DEAD; the last four are left out if empty. Replaces the file
/// atomically. Throws OutputError.
void write_calibration(const std::filesystem::path& file, const CalibrationTable& table);

/// Reads a file of write_calibration(). The file is untrusted: sizes, ranges and finiteness are checked.
/// Throws InputError with a one-line message.
[[nodiscard]] CalibrationTable read_calibration(const std::filesystem::path& file);

} // namespace obscura::transports
