// SPDX-License-Identifier: Apache-2.0
// Ordered dithering of fractional drive levels, spatial (Bayer matrix) and temporal (van der Corput
// sequence).
#pragma once

#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura::transports {

/// Domain over which the fraction of a level is averaged: none (levels are rounded), a block of 16x16 pixels,
/// 256 successive frames, or both.
enum class Dither : std::uint8_t { none, spatial, temporal, both };
/// Names in the configuration.
constexpr auto enum_names(Dither /*type*/) {
    return std::array{EnumName{Dither::none, "none"}, EnumName{Dither::spatial, "spatial"},
                      EnumName{Dither::temporal, "temporal"}, EnumName{Dither::both, "both"}};
}

/// Position of pixel (x, y) in the 16x16 ordered-dither matrix, 0..255 (Bayer 1973): each value occurs once
/// in a block and successive values are far apart.
[[nodiscard]] constexpr unsigned bayer16(unsigned x, unsigned y) {
    unsigned value = 0;
    for (unsigned bit = 0; bit < 4; ++bit) {
        const unsigned xb = (x >> bit) & 1u, yb = (y >> bit) & 1u;
        value |= ((xb ^ yb) << 1 | yb) << (6 - 2 * bit);
    }
    return value;
}

/// The 8 low bits of a frame number in reverse order: the van der Corput sequence. Any 2^k successive frames
/// that begin at a multiple of 2^k are spread evenly over the thresholds.
[[nodiscard]] constexpr unsigned reversed8(std::uint64_t frame) {
    unsigned value = 0;
    for (unsigned bit = 0; bit < 8; ++bit)
        value |= static_cast<unsigned>(frame >> bit & 1u) << (7 - bit);
    return value;
}

/// Threshold, 0..1 in steps of 1/256 level, added to the level before truncation. For `both` every pixel
/// passes through all 256 thresholds in 256 frames, and every 16x16 block holds all of them in one frame.
[[nodiscard]] constexpr float dither_threshold(Dither dither, unsigned x, unsigned y, std::uint64_t frame) {
    unsigned step = 0;
    switch (dither) {
    case Dither::none:
        return 0.5F;
    case Dither::spatial:
        step = bayer16(x, y);
        break;
    case Dither::temporal:
        step = reversed8(frame);
        break;
    case Dither::both:
        step = (bayer16(x, y) + reversed8(frame)) & 255u;
        break;
    }
    return (static_cast<float>(step) + 0.5F) / 256.0F;
}

} // namespace obscura::transports
