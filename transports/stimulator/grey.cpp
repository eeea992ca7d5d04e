// SPDX-License-Identifier: Apache-2.0
#include "transports/stimulator/grey.hpp"

#include <array>
#include <cassert>

namespace obscura::transports {

int grey_levels(gud::Format format, GreyCoding coding) {
    if (format == gud::Format::r8) return coding == GreyCoding::equal ? 256 : 0;
    if (format != gud::Format::rgb888 && format != gud::Format::xrgb8888) return 0;
    switch (coding) {
    case GreyCoding::equal:
        return 256;
    case GreyCoding::sum:
        return 3 * 255 + 1;
    case GreyCoding::high_low:
        return 65536;
    }
    return 0;
}

void pack_levels(gud::Format format, GreyCoding coding, std::span<const std::uint16_t> levels,
                 std::span<std::uint8_t> out) noexcept {
    const auto stride = static_cast<std::size_t>(gud::bytes_per_pixel(format));
    assert(out.size() >= levels.size() * stride);
    const auto byte = [](unsigned v) { return static_cast<std::uint8_t>(v); };
    if (format == gud::Format::r8) {
        for (std::size_t i = 0; i < levels.size(); ++i)
            out[i] = byte(levels[i]);
        return;
    }
    for (std::size_t i = 0; i < levels.size(); ++i) {
        const unsigned level = levels[i];
        std::array<std::uint8_t, 4> pixel{}; // blue, green, red, unused
        switch (coding) {
        case GreyCoding::equal:
            pixel = {byte(level), byte(level), byte(level), 0};
            break;
        case GreyCoding::sum:
            // Green, in the middle of the pixel, takes the first remaining level.
            pixel = {byte(level / 3), byte((level + 2) / 3), byte((level + 1) / 3), 0};
            break;
        case GreyCoding::high_low:
            pixel = {0, byte(level), byte(level >> 8), 0};
            break;
        }
        for (std::size_t b = 0; b < stride; ++b)
            out[i * stride + b] = pixel[b];
    }
}

} // namespace obscura::transports
