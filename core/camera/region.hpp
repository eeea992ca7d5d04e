// SPDX-License-Identifier: Apache-2.0
// A rectangle of pixels.
#pragma once

#include <cstdint>

namespace obscura {

/// Pixels [x, x+width) x [y, y+height); y grows downwards, (0,0) is the first pixel read.
struct Region {
    std::int32_t x = 0, y = 0, width = 0, height = 0;

    constexpr bool operator==(const Region&) const = default;
    [[nodiscard]] constexpr std::int64_t area() const { return std::int64_t{width} * height; }
    [[nodiscard]] constexpr bool inside(const Region& outer) const {
        return width > 0 && height > 0 && x >= outer.x && y >= outer.y && width <= outer.width &&
               height <= outer.height && x - outer.x <= outer.width - width &&
               y - outer.y <= outer.height - height;
    }
};

} // namespace obscura
