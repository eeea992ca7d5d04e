// What a calibration learnt about one screen in front of one camera, and the file it is kept in.
#pragma once

#include "transports/stimulator/radiometric_curve.hpp"
#include "transports/stimulator/screen_map.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::transports {

/// How strongly the camera sees each place of the screen, relative to the strongest: the screen's own
/// unevenness and the vignetting between. Nodes of a regular grid, bilinear between, constant outside. Empty:
/// 1 everywhere.
struct UniformityGrid {
    int columns = 0, rows = 0;
    double x0 = 0, y0 = 0, step = 1; ///< as in DistortionGrid
    std::vector<float> values;

    [[nodiscard]] double operator()(PixelPoint p) const;
};

/// Whole coordinates of a pixel of the screen.
struct ScreenPixel {
    std::int32_t x = 0, y = 0;
    bool operator==(const ScreenPixel&) const = default;
};

/// Everything the optical stage needs to know of a bench.
struct CalibrationTable {
    std::int32_t screen_width = 0, screen_height = 0;
    std::int32_t camera_width = 0, camera_height = 0;
    std::int32_t levels = 256; ///< drive levels of the curve
    ScreenMap map;
    std::vector<CurvePoint> curve; ///< empty: linear
    UniformityGrid uniformity;
    std::vector<ScreenPixel> dead; ///< pixels that do not follow their drive level
    double residual_px = 0;        ///< RMS of the dots about the map, camera pixels: for the reader
};

/// Writes `table` as FITS: an empty primary with the sizes in its header and one extension each for
/// HOMOGRAPHY, DISTORTION, CURVE, UNIFORMITY and DEAD, the last four only where there is something to say.
/// Replaces the file in one step. Throws OutputError.
void write_calibration(const std::filesystem::path& file, const CalibrationTable& table);

/// Reads what write_calibration() wrote. The file may come from anywhere: sizes, ranges and finiteness are
/// checked. Throws InputError with one line.
[[nodiscard]] CalibrationTable read_calibration(const std::filesystem::path& file);

} // namespace obscura::transports
