// Images that a camera makes by itself, to test what comes after it: SFNC TestPattern.
#pragma once

#include <cstdint>
#include <span>

namespace obscura {

/// SFNC TestPattern, as far as a monochrome camera has them; the values are those of the GigE Vision feature.
enum class ImagePattern : std::uint8_t {
    off,
    black,                  ///< 0
    white,                  ///< the largest number of the converter
    horizontal_ramp,        ///< sensor column, modulo the range
    vertical_ramp,          ///< sensor row, modulo the range
    horizontal_ramp_moving, ///< the same, one further with every frame
    vertical_ramp_moving,
    frame_counter, ///< every pixel is the frame id, modulo the range
};
constexpr std::uint32_t image_pattern_count = 8;

/// Writes the pixels of sensor row `y` from column `x` on, in digital numbers of `bits` bits.
void fill_pattern(ImagePattern pattern, std::uint64_t frame_id, std::int32_t x, std::int32_t y, int bits,
                  std::span<std::uint16_t> row) noexcept;

} // namespace obscura
