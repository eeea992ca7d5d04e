// SPDX-License-Identifier: Apache-2.0
// Vector drawing of discs, lines and text, written as SVG or as anti-aliased PNG.
#pragma once

#include "tools/pictures/colour_map.hpp"

#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace obscura::tools {

/// Points in pixels of the drawing: x to the right, y down, (0, 0) the upper left corner.
using DrawnPoint = std::pair<double, double>;

/// Drawing of fixed size; later marks cover earlier ones.
class Drawing {
public:
    Drawing(std::int32_t width, std::int32_t height, Rgb background)
        : width_(width), height_(height), background_(background) {}

    void disc(DrawnPoint centre, double radius, Rgb colour);
    void line(std::vector<DrawnPoint> points, double width, Rgb colour, bool dashed = false);
    void polygon(std::vector<DrawnPoint> points, Rgb colour);
    /// `at`: left end of the middle of the line of text; `shift`: 0 begins there, -0.5 is centred, -1 ends
    /// there.
    void text(DrawnPoint at, std::string text, Rgb colour, double shift = 0);
    /// Width and height of a text in a PNG; in an SVG it is about as large.
    [[nodiscard]] static DrawnPoint text_size(const std::string& text);

    [[nodiscard]] std::string svg() const;
    /// Throws OutputError.
    void write_png(const std::filesystem::path& file) const;

private:
    struct Disc {
        DrawnPoint centre;
        double radius;
        Rgb colour;
    };
    struct Line {
        std::vector<DrawnPoint> points;
        double width;
        Rgb colour;
        bool dashed;
    };
    struct Polygon {
        std::vector<DrawnPoint> points;
        Rgb colour;
    };
    struct Text {
        DrawnPoint at;
        std::string text;
        Rgb colour;
        double shift;
    };
    std::int32_t width_, height_;
    Rgb background_;
    std::vector<std::variant<Disc, Line, Polygon, Text>> marks_;
};

} // namespace obscura::tools
