// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/drawing.hpp"

#include "core/overloaded.hpp"
#include "core/text/text.hpp"
#include "tools/pictures/figure.hpp"
#include "tools/pictures/font.hpp"
#include "tools/pictures/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace obscura::tools {
namespace {

constexpr double dash = 5, gap = 4;

std::string hex(Rgb c) {
    return fmt::format("#{:02x}{:02x}{:02x}", c[0], c[1], c[2]);
}

std::string svg_path(const std::vector<DrawnPoint>& points) {
    std::string out;
    for (const auto& [x, y] : points)
        fmt::format_to(std::back_inserter(out), "{}{:.2f} {:.2f}", out.empty() ? "M" : " L", x, y);
    return out;
}

/// Canvas with partly covered pixels.
class Painter {
public:
    explicit Painter(Canvas& canvas) : canvas_(canvas) {}

    /// Covers the pixels of a box by `share(x, y)` of the distance to their centres, 0 to 1.
    template<typename Share>
    void cover(double x0, double y0, double x1, double y1, Rgb colour, const Share& share) {
        const auto from = [](double a) { return std::max(0, static_cast<std::int32_t>(std::floor(a))); };
        const auto to = [](double a, std::int32_t most) {
            return std::min(most - 1, static_cast<std::int32_t>(std::ceil(a)));
        };
        if (!(x1 >= 0 && y1 >= 0 && x0 < canvas_.width() && y0 < canvas_.height())) return;
        for (std::int32_t y = from(y0); y <= to(y1, canvas_.height()); ++y)
            for (std::int32_t x = from(x0); x <= to(x1, canvas_.width()); ++x)
                blend(x, y, colour, std::clamp(share(x + 0.5, y + 0.5), 0.0, 1.0));
    }
    void segment(DrawnPoint a, DrawnPoint b, double width, Rgb colour) {
        const double dx = b.first - a.first, dy = b.second - a.second;
        const double length2 = dx * dx + dy * dy, reach = width / 2 + 1;
        cover(std::min(a.first, b.first) - reach, std::min(a.second, b.second) - reach,
              std::max(a.first, b.first) + reach, std::max(a.second, b.second) + reach, colour,
              [&](double x, double y) {
                  const double t =
                      length2 > 0 ? std::clamp(((x - a.first) * dx + (y - a.second) * dy) / length2, 0.0, 1.0)
                                  : 0;
                  return width / 2 + 0.5 - std::hypot(x - a.first - t * dx, y - a.second - t * dy);
              });
    }

private:
    void blend(std::int32_t x, std::int32_t y, Rgb colour, double share) {
        if (share <= 0) return;
        Rgb mixed = canvas_.at(x, y);
        for (std::size_t i = 0; i < mixed.size(); ++i)
            mixed[i] = static_cast<std::uint8_t>(std::lround(mixed[i] + share * (colour[i] - mixed[i])));
        canvas_.fill(x, y, 1, 1, mixed);
    }

    Canvas& canvas_;
};

/// Parts of a dashed line, or all of it.
void each_part(const std::vector<DrawnPoint>& points, bool dashed, const auto& draw) {
    double at = 0; // along the line
    for (std::size_t i = 1; i < points.size(); ++i) {
        const DrawnPoint a = points[i - 1], b = points[i];
        const double length = std::hypot(b.first - a.first, b.second - a.second);
        if (!dashed || length == 0) {
            draw(a, b);
            continue;
        }
        const auto point = [&](double s) {
            return DrawnPoint{a.first + (b.first - a.first) * s / length,
                              a.second + (b.second - a.second) * s / length};
        };
        for (double s = 0; s < length;) {
            const double phase = std::fmod(at + s, dash + gap);
            const double end = std::min(length, s + (phase < dash ? dash : dash + gap) - phase + 1e-6);
            if (phase < dash) draw(point(s), point(end));
            s = end;
        }
        at += length;
    }
}

bool inside(const std::vector<DrawnPoint>& points, double x, double y) {
    bool in = false;
    for (std::size_t i = 0, j = points.size() - 1; i < points.size(); j = i++)
        if ((points[i].second > y) != (points[j].second > y) &&
            x < (points[j].first - points[i].first) * (y - points[i].second) /
                        (points[j].second - points[i].second) +
                    points[i].first)
            in = !in;
    return in;
}

} // namespace

void Drawing::disc(DrawnPoint centre, double radius, Rgb colour) {
    marks_.emplace_back(Disc{centre, radius, colour});
}

void Drawing::line(std::vector<DrawnPoint> points, double width, Rgb colour, bool dashed) {
    if (points.size() > 1) marks_.emplace_back(Line{std::move(points), width, colour, dashed});
}

void Drawing::polygon(std::vector<DrawnPoint> points, Rgb colour) {
    if (points.size() > 2) marks_.emplace_back(Polygon{std::move(points), colour});
}

void Drawing::text(DrawnPoint at, std::string text, Rgb colour, double shift) {
    marks_.emplace_back(Text{at, std::move(text), colour, shift});
}

DrawnPoint Drawing::text_size(const std::string& text) {
    return {Canvas::text_width(text, 1), glyph_height};
}

std::string Drawing::svg() const {
    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" viewBox=\"0 0 {0} {1}\">\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"{2}\"/>\n"
        "<g font-family=\"DejaVu Sans, Helvetica, sans-serif\" font-size=\"11\">\n",
        width_, height_, hex(background_));
    const Overloaded write{
        [&](const Disc& d) {
            out += fmt::format("<circle cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"{:.2f}\" fill=\"{}\"/>\n",
                               d.centre.first, d.centre.second, d.radius, hex(d.colour));
        },
        [&](const Line& l) {
            out += fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{:.2f}\"{}/>\n",
                               svg_path(l.points), hex(l.colour), l.width,
                               l.dashed ? fmt::format(" stroke-dasharray=\"{} {}\"", dash, gap) : "");
        },
        [&](const Polygon& p) {
            out += fmt::format("<path d=\"{} Z\" fill=\"{}\"/>\n", svg_path(p.points), hex(p.colour));
        },
        [&](const Text& t) {
            out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" fill=\"{}\" text-anchor=\"{}\">{}</text>\n",
                               t.at.first, t.at.second + 4, hex(t.colour),
                               t.shift == 0      ? "start"
                               : t.shift > -0.75 ? "middle"
                                                 : "end",
                               escaped_xml(t.text));
        }};
    for (const auto& mark : marks_)
        std::visit(write, mark);
    return out + "</g>\n</svg>\n";
}

void Drawing::write_png(const std::filesystem::path& file) const {
    Canvas canvas(width_, height_, background_);
    Painter painter(canvas);
    const Overloaded paint{
        [&](const Disc& d) {
            const auto [x0, y0] = d.centre;
            const double reach = d.radius + 1;
            painter.cover(x0 - reach, y0 - reach, x0 + reach, y0 + reach, d.colour, [&](double x, double y) {
                return d.radius + 0.5 - std::hypot(x - d.centre.first, y - d.centre.second);
            });
        },
        [&](const Line& l) {
            each_part(l.points, l.dashed,
                      [&](DrawnPoint a, DrawnPoint b) { painter.segment(a, b, l.width, l.colour); });
        },
        [&](const Polygon& p) {
            double x0 = width_, y0 = height_, x1 = 0, y1 = 0;
            for (const auto& [x, y] : p.points)
                x0 = std::min(x0, x), x1 = std::max(x1, x), y0 = std::min(y0, y), y1 = std::max(y1, y);
            painter.cover(x0, y0, x1, y1, p.colour,
                          [&](double x, double y) { return inside(p.points, x, y) ? 1.0 : 0.0; });
        },
        [&](const Text& t) {
            const auto [width, height] = text_size(t.text);
            canvas.text(static_cast<std::int32_t>(std::lround(t.at.first + t.shift * width)),
                        static_cast<std::int32_t>(std::lround(t.at.second - height / 2)), t.text, 1,
                        t.colour);
        }};
    for (const auto& mark : marks_)
        std::visit(paint, mark);
    canvas.write(file);
}

} // namespace obscura::tools
