// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/plot.hpp"

#include "core/text/text.hpp"
#include "tools/pictures/ticks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace obscura::tools {
namespace {

constexpr double width = 570, height = 360, left = 84, right = 16, top = 56, bottom = 54;
constexpr std::array colours{"#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#8c564b"};

/// One axis: limits, ticks and the place of values, in pixels.
class Axis {
public:
    Axis(bool logarithmic, double from_px, double to_px)
        : logarithmic_(logarithmic), from_px_(from_px), to_px_(to_px) {}

    [[nodiscard]] bool shows(double v) const { return std::isfinite(v) && (!logarithmic_ || v > 0); }
    void include(double v) {
        if (shows(v)) low_ = std::min(low_, scaled(v)), high_ = std::max(high_, scaled(v));
    }
    /// Sets the limits once all values are included.
    void close() {
        if (!(low_ <= high_)) low_ = 0, high_ = 1;
        if (low_ == high_) low_ -= 0.5, high_ += 0.5;
        const double room = 0.04 * (high_ - low_);
        // Axes of quantities that cannot be negative begin at zero.
        const bool from_zero = !logarithmic_ && low_ >= 0 && low_ < 0.4 * high_;
        low_ = from_zero ? 0 : low_ - room;
        high_ += room;
    }
    [[nodiscard]] double at(double v) const {
        return from_px_ + (scaled(v) - low_) / (high_ - low_) * (to_px_ - from_px_);
    }
    [[nodiscard]] bool inside(double v) const { return shows(v) && scaled(v) >= low_ && scaled(v) <= high_; }
    [[nodiscard]] std::vector<double> ticks() const {
        constexpr double per_tick_px = 48;
        if (logarithmic_) return decade_ticks(std::pow(10.0, low_), std::pow(10.0, high_));
        return round_ticks(low_, high_,
                           std::max(3, static_cast<int>(std::fabs(to_px_ - from_px_) / per_tick_px)));
    }
    [[nodiscard]] std::vector<std::string> labels() const {
        const std::vector<double> values = ticks();
        std::vector<std::string> out = tick_labels(values);
        // Powers of ten outside 0.01 to 1000 with their exponents raised.
        for (std::size_t i = 0; i < values.size(); ++i) {
            const double exponent = std::log10(values[i]);
            const long whole = std::lround(exponent);
            if (!logarithmic_ || std::fabs(exponent - static_cast<double>(whole)) > 1e-9 ||
                (whole >= -2 && whole <= 3))
                continue;
            out[i] = fmt::format("10<tspan dy=\"-5\" font-size=\"9\">{}</tspan>", whole);
        }
        return out;
    }

private:
    [[nodiscard]] double scaled(double v) const { return logarithmic_ ? std::log10(v) : v; }
    bool logarithmic_;
    double from_px_, to_px_;
    double low_ = std::numeric_limits<double>::infinity(), high_ = -low_;
};

std::string polyline(const PlotSeries& series, const Axis& x, const Axis& y, const char* colour) {
    std::string out = fmt::format("<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.5\"{} points=\"",
                                  colour, series.drawn == Drawn::dashed ? " stroke-dasharray=\"6 4\"" : "");
    for (const auto& [u, v] : series.points)
        if (x.inside(u) && y.inside(v)) out += fmt::format("{:.1f},{:.1f} ", x.at(u), y.at(v));
    return out + "\"/>\n";
}

std::string symbols(const PlotSeries& series, const Axis& x, const Axis& y, const char* colour) {
    std::string out;
    for (const auto& [u, v] : series.points) {
        if (!x.shows(u) || !y.shows(v)) continue;
        if (series.drawn == Drawn::bars)
            out += fmt::format("<path d=\"M{:.1f} {:.1f}V{}\" stroke=\"{}\" stroke-width=\"4\"/>", x.at(u),
                               y.at(v), height - bottom, colour);
        else
            out += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.6\" fill=\"{}\"/>", x.at(u),
                               y.at(v), colour);
    }
    return out + "\n";
}

std::string legend_entry(const PlotSeries& series, double at, const char* colour) {
    constexpr double line = 39;
    const std::string sample =
        series.drawn == Drawn::points
            ? fmt::format("<circle cx=\"{:.1f}\" cy=\"{}\" r=\"2.6\" fill=\"{}\"/>", at + 10, line, colour)
            : fmt::format("<path d=\"M{:.1f} {}h20\" stroke=\"{}\" stroke-width=\"{}\"{}/>", at, line, colour,
                          series.drawn == Drawn::bars ? 6 : 2,
                          series.drawn == Drawn::dashed ? " stroke-dasharray=\"6 4\"" : "");
    return sample + fmt::format("<text x=\"{:.1f}\" y=\"{}\">{}</text>\n", at + 25, line + 4,
                                escaped_xml(series.name));
}

} // namespace

std::string svg(const Plot& plot) {
    Axis x(plot.log_x, left, width - right), y(plot.log_y, height - bottom, top);
    for (const PlotSeries& series : plot.series)
        for (const auto& [u, v] : series.points)
            if (x.shows(u) && y.shows(v)) x.include(u), y.include(v);
    for (const PlotMark& mark : plot.marks)
        (mark.horizontal ? y : x).include(mark.at);
    for (const PlotSeries& series : plot.series)
        if (series.drawn == Drawn::bars && !plot.log_y) y.include(0);
    x.close(), y.close();

    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" font-size=\"12\" font-family=\"sans-serif\"><rect width=\"{0}\" height=\"{1}\" fill=\"white\"/><text x=\"{2}\" y=\"22\" font-size=\"15\">{3}</text>\n",
        width, height, left, escaped_xml(plot.title));
    const std::vector<double> xs = x.ticks(), ys = y.ticks();
    const std::vector<std::string> x_labels = x.labels(), y_labels = y.labels();
    for (std::size_t i = 0; i < xs.size(); ++i)
        out += fmt::format(
            "<path d=\"M{0:.1f} {1}V{2}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4}</text>\n",
            x.at(xs[i]), top, height - bottom, height - bottom + 17, x_labels[i]);
    for (std::size_t i = 0; i < ys.size(); ++i)
        out += fmt::format(
            "<path d=\"M{0} {1:.1f}H{2}\" stroke=\"#ddd\"/><text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\">{5}</text>\n",
            left, y.at(ys[i]), width - right, left - 6, y.at(ys[i]) + 4, y_labels[i]);
    out += fmt::format("<path d=\"M{} {}V{}H{}\" fill=\"none\" stroke=\"#333\"/>\n", left, top,
                       height - bottom, width - right);
    out += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">{}</text><text x=\"15\" y=\"{}\" transform=\"rotate(-90 15 {})\" text-anchor=\"middle\">{}</text>\n",
        (left + width - right) / 2, height - 14, escaped_xml(plot.x_label), (top + height - bottom) / 2,
        (top + height - bottom) / 2, escaped_xml(plot.y_label));
    double legend_at = left;
    for (std::size_t i = 0; i < plot.series.size(); ++i) {
        const PlotSeries& series = plot.series[i];
        const char* const colour = colours[i % colours.size()];
        out += series.drawn == Drawn::line || series.drawn == Drawn::dashed ? polyline(series, x, y, colour)
                                                                            : symbols(series, x, y, colour);
        if (series.name.empty()) continue;
        constexpr double character_px = 6.2, gap_px = 40;
        out += legend_entry(series, legend_at, colour);
        legend_at += gap_px + character_px * static_cast<double>(series.name.size());
    }
    for (const PlotMark& mark : plot.marks) {
        if (!(mark.horizontal ? y : x).shows(mark.at)) continue;
        if (mark.horizontal)
            out += fmt::format(
                "<path d=\"M{0} {1:.1f}H{2}\" stroke=\"#777\" stroke-dasharray=\"2 3\"/><text x=\"{3}\" y=\"{4:.1f}\" text-anchor=\"end\" fill=\"#555\">{5}</text>\n",
                left, y.at(mark.at), width - right, width - right - 4, y.at(mark.at) - 4,
                escaped_xml(mark.label));
        else
            out += fmt::format(
                "<path d=\"M{0:.1f} {1}V{2}\" stroke=\"#777\" stroke-dasharray=\"2 3\"/><text transform=\"translate({3:.1f} {4}) rotate(-90)\" text-anchor=\"end\" fill=\"#555\">{5}</text>\n",
                x.at(mark.at), top, height - bottom, x.at(mark.at) - 4, top + 4, escaped_xml(mark.label));
    }
    return out + "</svg>\n";
}

std::string svg(const std::vector<Plot>& plots) {
    std::string out = fmt::format("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{}\" height=\"{}\">\n",
                                  width, height * static_cast<double>(plots.size()));
    for (std::size_t i = 0; i < plots.size(); ++i) {
        constexpr std::string_view opening = "<svg ";
        out += fmt::format("<svg y=\"{}\" height=\"{}\" ", height * static_cast<double>(i), height);
        out += svg(plots[i]).substr(opening.size());
    }
    return out + "</svg>\n";
}

} // namespace obscura::tools
