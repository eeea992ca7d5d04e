// SPDX-License-Identifier: Apache-2.0
// Grey coding: packing of grey levels into display pixels.
#pragma once

#include "core/text/enum_names.hpp"
#include "transports/stimulator/gud.hpp"

#include <array>
#include <cstdint>
#include <span>

namespace obscura::transports {

/// Use of the three channels of a colour format. Monochrome panels for instruments are driven in one of these
/// ways; R8 has one channel and supports `equal` only.
enum class GreyCoding : std::uint8_t {
    equal, ///< all channels equal: 256 levels
    /// Channels are sub-pixels whose light adds up: 766 levels, spread evenly over them.
    sum,
    /// Red carries the high byte, green the low byte, blue 0: 65536 levels.
    high_low,
};
/// Names in configurations and on command lines.
constexpr auto enum_names(GreyCoding /*type*/) {
    return std::array{EnumName{GreyCoding::equal, "equal"}, EnumName{GreyCoding::sum, "sum"},
                      EnumName{GreyCoding::high_low, "high_low"}};
}

/// Number of grey levels that `format` shows under `coding`; 0 if the format does not support the coding.
[[nodiscard]] int grey_levels(gud::Format format, GreyCoding coding);

/// Packs levels (each below grey_levels()) in wire format: DRM formats are little endian words, so the byte
/// order of RGB888 is blue, green, red, and XRGB8888 has a fourth, unused byte. `out` has bytes_per_pixel()
/// bytes per level.
void pack_levels(gud::Format format, GreyCoding coding, std::span<const std::uint16_t> levels,
                 std::span<std::uint8_t> out) noexcept;

} // namespace obscura::transports
