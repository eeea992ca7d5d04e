// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/figure.hpp"

#include "images/writers/png.hpp"
#include "tools/pictures/font.hpp"
#include "tools/pictures/ticks.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::tools {
namespace {

constexpr Rgb ink{30, 30, 30};

/// Distances in pixels, by the scale of the text.
struct Measures {
    std::int32_t magnification, scale;

    explicit Measures(const std::vector<Panel>& panels) {
        std::int32_t side = 1;
        for (const Panel& p : panels)
            side = std::max({side, p.width, p.height});
        constexpr std::int32_t smallest = 320, per_text_scale = 900;
        magnification = std::max(1, smallest / side);
        scale = std::max(1, side * magnification / per_text_scale);
    }
    [[nodiscard]] std::int32_t line() const { return scale * (glyph_height + 5); }
    [[nodiscard]] std::int32_t margin() const { return 10 * scale; }
    [[nodiscard]] std::int32_t bar() const { return 16 * scale; }
    [[nodiscard]] std::int32_t tick() const { return 4 * scale; }
    [[nodiscard]] std::int32_t text(std::string_view t) const { return Canvas::text_width(t, scale); }
};

std::vector<double> bar_ticks(const ColourScale& scale, std::int32_t length, const Measures& m) {
    const std::int32_t apart = 2 * m.line();
    if (!scale.position) return round_ticks(scale.low, scale.high, std::max(3, length / apart));
    return spread_ticks(
        scale.low, scale.high, [&](double v) { return scale.level(v); },
        static_cast<double>(apart) / std::max(1, length));
}

/// Width to the right of a panel that its bar or legend takes.
std::int32_t key_width(const Panel& panel, const Measures& m) {
    std::int32_t widest = 0;
    if (panel.scale) {
        for (const std::string& label :
             tick_labels(bar_ticks(*panel.scale, panel.height * m.magnification, m)))
            widest = std::max(widest, m.bar() + 2 * m.tick() + m.text(label));
        widest = std::max(widest, m.text(panel.scale->label));
    }
    for (const auto& [unused, name] : panel.legend)
        widest = std::max(widest, m.bar() + 2 * m.tick() + m.text(name));
    return widest > 0 ? widest + 2 * m.margin() : 0;
}

void draw_bar(Canvas& canvas, const ColourScale& scale, std::int32_t x, std::int32_t y, std::int32_t length,
              const Measures& m) {
    canvas.text(x, y - m.line(), scale.label, m.scale, ink);
    for (std::int32_t row = 0; row < length; ++row)
        canvas.fill(x, y + row, m.bar(), 1, colour(scale.map, 1 - (row + 0.5) / static_cast<double>(length)));
    canvas.outline(x, y, m.bar(), length, m.scale, ink);
    const std::vector<double> ticks = bar_ticks(scale, length, m);
    const std::vector<std::string> labels = tick_labels(ticks);
    for (std::size_t i = 0; i < ticks.size(); ++i) {
        const auto at =
            y + static_cast<std::int32_t>(std::lround((1 - scale.level(ticks[i])) * (length - 1)));
        canvas.fill(x + m.bar(), at, m.tick(), m.scale, ink);
        canvas.text(x + m.bar() + 2 * m.tick(), at - m.scale * glyph_height / 2, labels[i], m.scale, ink);
    }
}

} // namespace

Canvas::Canvas(std::int32_t width, std::int32_t height, Rgb background)
    : width_(width),
      height_(height),
      bytes_(3 * static_cast<std::size_t>(width) * static_cast<std::size_t>(height)) {
    fill(0, 0, width, height, background);
}

void Canvas::fill(std::int32_t x, std::int32_t y, std::int32_t width, std::int32_t height, Rgb colour) {
    for (std::int32_t v = std::max(0, y); v < std::min(height_, y + height); ++v)
        for (std::int32_t u = std::max(0, x); u < std::min(width_, x + width); ++u) {
            const std::size_t at = 3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(width_) +
                                        static_cast<std::size_t>(u));
            std::copy(colour.begin(), colour.end(), bytes_.begin() + static_cast<std::ptrdiff_t>(at));
        }
}

void Canvas::outline(std::int32_t x, std::int32_t y, std::int32_t width, std::int32_t height,
                     std::int32_t thickness, Rgb colour) {
    fill(x, y, width, thickness, colour);
    fill(x, y + height - thickness, width, thickness, colour);
    fill(x, y, thickness, height, colour);
    fill(x + width - thickness, y, thickness, height, colour);
}

void Canvas::text(std::int32_t x, std::int32_t y, std::string_view text, std::int32_t scale, Rgb colour) {
    for (const Glyph* glyph : glyphs(text)) {
        for (std::int32_t v = 0; v < glyph_height; ++v)
            for (std::int32_t u = 0; u < glyph_width; ++u)
                if ((glyph->rows[static_cast<std::size_t>(v)] >> (7 - u) & 1) != 0)
                    fill(x + u * scale, y + v * scale, scale, scale, colour);
        x += glyph_width * scale;
    }
}

std::int32_t Canvas::text_width(std::string_view text, std::int32_t scale) {
    return static_cast<std::int32_t>(glyphs(text).size()) * glyph_width * scale;
}

Rgb Canvas::at(std::int32_t x, std::int32_t y) const {
    const std::size_t at =
        3 * (static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x));
    return {bytes_[at], bytes_[at + 1], bytes_[at + 2]};
}

void Canvas::write(const std::filesystem::path& file) const {
    images::write_png_rgb(file, width_, height_, bytes_, {});
}

double ColourScale::level(double value) const {
    if (position) return std::clamp(position(value), 0.0, 1.0);
    return high > low ? std::clamp((value - low) / (high - low), 0.0, 1.0) : 0.5;
}

Rgb ColourScale::colour_of(double value) const {
    return std::isnan(value) ? no_value_colour : colour(map, level(value));
}

Canvas draw_panels(const std::vector<Panel>& panels) {
    const Measures m(panels);
    std::int32_t width = m.margin(), height = 0;
    const auto panel_width = [&](const Panel& p) {
        return std::max(p.width * m.magnification, p.scale ? 0 : m.text(p.title));
    };
    const auto slot = [&](const Panel& p) {
        const std::int32_t key = key_width(p, m), own = panel_width(p) + m.margin();
        // The title may reach over the key, but for the label of a bar.
        const std::int32_t title = m.text(p.title) + 2 * m.margin();
        return p.scale ? std::max(own, title) + key : std::max(own + key, title);
    };
    for (const Panel& p : panels) {
        const auto lines = static_cast<std::int32_t>(p.legend.size());
        width += slot(p);
        height = std::max({height, p.height * m.magnification, lines * m.line()});
    }
    const std::int32_t top = m.margin() + m.line();
    Canvas canvas(width, top + height + m.margin(), white);
    std::int32_t left = m.margin();
    for (const Panel& p : panels) {
        canvas.text(left, m.margin(), p.title, m.scale, ink);
        for (std::int32_t y = 0; y < p.height; ++y)
            for (std::int32_t x = 0; x < p.width; ++x)
                canvas.fill(left + x * m.magnification, top + y * m.magnification, m.magnification,
                            m.magnification,
                            p.pixels[static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width) +
                                     static_cast<std::size_t>(x)]);
        const std::int32_t key =
            left +
            (p.scale ? std::max(panel_width(p), m.text(p.title) + m.margin()) : p.width * m.magnification) +
            m.margin();
        if (p.scale) draw_bar(canvas, *p.scale, key, top, p.height * m.magnification, m);
        std::int32_t y = top;
        for (const auto& [swatch, name] : p.legend) {
            canvas.fill(key, y, m.bar(), m.scale * glyph_height, swatch);
            canvas.text(key + m.bar() + 2 * m.tick(), y, name, m.scale, ink);
            y += m.line();
        }
        left += slot(p);
    }
    return canvas;
}

} // namespace obscura::tools
