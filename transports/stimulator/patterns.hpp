// SPDX-License-Identifier: Apache-2.0
// Test patterns of the stimulator calibration: flat fields, Gray codes, dots.
#pragma once

#include "transports/stimulator/screen_map.hpp"

#include <cstdint>
#include <string>
#include <vector>

namespace obscura::transports {

/// One picture of the sequence, in drive levels 0 .. levels - 1.
struct Pattern {
    enum class Kind : std::uint8_t { flat, column_bit, row_bit, dots };
    /// "white", "column_03", "column_03_inverse", "ramp_00128", "dots"; also the name of the capture.
    std::string name;
    Kind kind = Kind::flat;
    int bit = 0; ///< bit of the Gray code, 0 is the coarsest
    bool inverse = false;
    int level = 0; ///< drive level of a flat pattern
};

/// Patterns for one screen: black, white, Gray codes of columns and rows each with its inverse (Inokuchi et
/// al. 1984), dots, and a ramp of flat fields.
class PatternSequence {
public:
    /// `ramp_steps` levels from dark to bright, at least 2; dots every `dot_step` pixels.
    PatternSequence(std::int32_t width, std::int32_t height, int levels, int ramp_steps,
                    std::int32_t dot_step);

    [[nodiscard]] const std::vector<Pattern>& patterns() const { return patterns_; }
    /// Drive levels of the pattern, row by row.
    [[nodiscard]] std::vector<std::uint16_t> draw(const Pattern& pattern) const;

    [[nodiscard]] std::int32_t width() const { return width_; }
    [[nodiscard]] std::int32_t height() const { return height_; }
    [[nodiscard]] int levels() const { return levels_; }
    [[nodiscard]] int column_bits() const { return column_bits_; }
    [[nodiscard]] int row_bits() const { return row_bits_; }
    [[nodiscard]] std::int32_t dot_step() const { return dot_step_; }
    [[nodiscard]] std::int32_t dot_radius() const { return dot_radius_; }
    /// Number of dots across and down, and the centre of a dot.
    [[nodiscard]] int dot_columns() const { return static_cast<int>(width_ / dot_step_); }
    [[nodiscard]] int dot_rows() const { return static_cast<int>(height_ / dot_step_); }
    [[nodiscard]] PixelPoint dot(int column, int row) const;

private:
    std::int32_t width_, height_;
    int levels_;
    std::int32_t dot_step_, dot_radius_;
    int column_bits_, row_bits_;
    std::vector<Pattern> patterns_;
};

/// Reflected binary Gray code of `value`, and its inverse.
[[nodiscard]] constexpr std::uint32_t to_gray(std::uint32_t value) {
    return value ^ (value >> 1);
}
[[nodiscard]] constexpr std::uint32_t from_gray(std::uint32_t gray) {
    for (unsigned shift = 16; shift > 0; shift /= 2)
        gray ^= gray >> shift;
    return gray;
}

} // namespace obscura::transports
