// SPDX-License-Identifier: Apache-2.0
// Rule for the two pitches of rectangular pixels: one for the sensor and the camera of a scene.
#pragma once

#include <fmt/format.h>

#include <string>

namespace obscura {

/// Largest ratio of the two pitches of a pixel; that of tall pixels of line cameras is below 20.
constexpr double largest_pitch_ratio = 32;

/// What is wrong with the value of a key pixel_pitch_y_um beside that of pixel_pitch_um; empty if nothing is.
/// 0: square pixels.
[[nodiscard]] inline std::string explain_invalid_row_pitch(double column_pitch_m, double row_pitch_m) {
    const double ratio = row_pitch_m / column_pitch_m;
    if (row_pitch_m == 0 || (ratio >= 1 / largest_pitch_ratio && ratio <= largest_pitch_ratio)) return {};
    return fmt::format("{:g} is out of range beside pixel_pitch_um = {:g}, allowed 0 or {:g} to {:g}",
                       row_pitch_m * 1e6, column_pitch_m * 1e6, column_pitch_m * 1e6 / largest_pitch_ratio,
                       column_pitch_m * 1e6 * largest_pitch_ratio);
}

} // namespace obscura
