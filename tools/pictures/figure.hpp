// SPDX-License-Identifier: Apache-2.0
// Pictures for people: image panels with titles, colour bars and legends in one RGB PNG.
#pragma once

#include "tools/pictures/colour_map.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::tools {

/// RGB image that is drawn on; whatever lies outside is cut off.
class Canvas {
public:
    Canvas(std::int32_t width, std::int32_t height, Rgb background);

    void fill(std::int32_t x, std::int32_t y, std::int32_t width, std::int32_t height, Rgb colour);
    /// Frame along the inner border of the rectangle.
    void outline(std::int32_t x, std::int32_t y, std::int32_t width, std::int32_t height,
                 std::int32_t thickness, Rgb colour);
    /// `text` (UTF-8) with its upper left corner at (x, y); one line.
    void text(std::int32_t x, std::int32_t y, std::string_view text, std::int32_t scale, Rgb colour);
    [[nodiscard]] static std::int32_t text_width(std::string_view text, std::int32_t scale);

    [[nodiscard]] std::int32_t width() const { return width_; }
    [[nodiscard]] std::int32_t height() const { return height_; }
    [[nodiscard]] Rgb at(std::int32_t x, std::int32_t y) const;
    /// Writes an RGB PNG. Throws OutputError.
    void write(const std::filesystem::path& file) const;

private:
    std::int32_t width_, height_;
    std::vector<std::uint8_t> bytes_;
};

/// What the colours of a panel mean.
struct ColourScale {
    ColourMap map = ColourMap::grey;
    double low = 0, high = 1;
    std::string label; ///< quantity or unit, above the bar
    /// Maps low .. high to 0 .. 1; empty: linear.
    std::function<double(double)> position;

    [[nodiscard]] double level(double value) const;
    [[nodiscard]] Rgb colour_of(double value) const; ///< no_value_colour for NaN
};

struct Panel {
    std::string title;
    std::int32_t width = 0, height = 0;
    std::vector<Rgb> pixels;                         ///< row-major
    std::optional<ColourScale> scale;                ///< drawn as a bar to the right
    std::vector<std::pair<Rgb, std::string>> legend; ///< drawn to the right
};

/// The panels side by side, small images magnified by a whole number.
[[nodiscard]] Canvas draw_panels(const std::vector<Panel>& panels);

} // namespace obscura::tools
