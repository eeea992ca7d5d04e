// SPDX-License-Identifier: Apache-2.0
// Bitmap font of 7 x 13 pixels for text in pictures.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

namespace obscura::tools {

constexpr std::int32_t glyph_width = 7, glyph_height = 13;

struct Glyph {
    char32_t code;
    std::array<std::uint8_t, glyph_height> rows; ///< the highest bit is the left pixel
};

/// Glyphs in the order of their codes: ASCII and the symbols that units need.
[[nodiscard]] std::span<const Glyph> font();

/// Glyphs of `text` (UTF-8); characters that the font lacks appear as question marks.
[[nodiscard]] std::vector<const Glyph*> glyphs(std::string_view text);

} // namespace obscura::tools
