// How a grey level becomes the bytes of a display pixel.
#pragma once

#include "core/enum_names.hpp"
#include "transports/stimulator/gud.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace obscura::transports {

/// What the three channels of a colour format carry. Monochrome panels for instruments are driven in one of
/// these ways; R8 has one channel and knows `equal` only.
enum class GreyCoding : std::uint8_t {
    equal,    ///< all channels alike: 256 levels
    sum,      ///< the channels are sub-pixels whose light adds up: 766 levels, spread evenly over them
    high_low, ///< red carries the high byte, green the low byte, blue 0: 65536 levels
};
/// Names in configurations and on command lines.
constexpr auto enum_names(GreyCoding /*type*/) {
    return std::array{EnumName{GreyCoding::equal, "equal"}, EnumName{GreyCoding::sum, "sum"},
                      EnumName{GreyCoding::high_low, "high_low"}};
}

/// Number of grey levels that `format` shows under `coding`; 0 when the two do not go together.
[[nodiscard]] int grey_levels(gud::Format format, GreyCoding coding);

/// Packs levels (each below grey_levels()) as the wire wants them: DRM formats are little endian words, so
/// that the bytes of RGB888 run blue, green, red, and XRGB8888 has a fourth, unused one. `out` has
/// bytes_per_pixel() bytes a level.
void pack_levels(gud::Format format, GreyCoding coding, std::span<const std::uint16_t> levels,
                 std::span<std::uint8_t> out) noexcept;

} // namespace obscura::transports
