// SPDX-License-Identifier: Apache-2.0
#include "core/camera/image_pattern.hpp"

#include <algorithm>

namespace obscura {

void fill_pattern(ImagePattern pattern, std::uint64_t frame_id, std::int32_t x, std::int32_t y, int bits,
                  std::span<std::uint16_t> row) noexcept {
    const std::uint64_t top = (std::uint64_t{1} << bits) - 1;
    std::uint64_t value = 0, step = 0;
    switch (pattern) {
    case ImagePattern::off:
    case ImagePattern::black:
        break;
    case ImagePattern::white:
        value = top;
        break;
    case ImagePattern::horizontal_ramp_moving:
        value = frame_id;
        [[fallthrough]];
    case ImagePattern::horizontal_ramp:
        value += static_cast<std::uint64_t>(x);
        step = 1;
        break;
    case ImagePattern::vertical_ramp_moving:
        value = frame_id;
        [[fallthrough]];
    case ImagePattern::vertical_ramp:
        value += static_cast<std::uint64_t>(y);
        break;
    case ImagePattern::frame_counter:
        value = frame_id;
        break;
    }
    for (std::uint16_t& pixel : row) {
        pixel = static_cast<std::uint16_t>(value & top);
        value += step;
    }
}

} // namespace obscura
