// SPDX-License-Identifier: Apache-2.0
#include "tools/pictures/readout_picture.hpp"

#include "core/text/text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::tools {
namespace {

constexpr double picture_width = 900, height = 520, left = 70, top = 50, right = 20, bottom = 60;
constexpr std::string_view window_colours[] = {"#1f77b4", "#d62728", "#2ca02c",
                                               "#9467bd", "#ff7f0e", "#17becf"};

} // namespace

std::string readout_picture(std::string_view title, const sensors::ReadoutPlan& plan) {
    Time begin = plan.rows.front().reset, end = plan.rows.front().read;
    std::int32_t low = plan.sensor_row.front(), high = low;
    for (std::size_t i = 0; i < plan.rows.size(); ++i) {
        begin = std::min(begin, plan.rows[i].reset);
        end = std::max({end, plan.rows[i].read, plan.release[i]});
        low = std::min(low, plan.sensor_row[i]);
        high = std::max(high, plan.sensor_row[i]);
    }
    const bool in_order = std::is_sorted(plan.rows.begin(), plan.rows.end(),
                                         [](const RowTime& a, const RowTime& b) { return a.read < b.read; });
    const double span = std::max<double>(1, static_cast<double>(end - begin));
    const double rows = high - low + 1;
    const auto x = [&](Time t) {
        return left + static_cast<double>(t - begin) / span * (picture_width - left - right);
    };
    const auto y = [&](double row) { return top + (row - low) / rows * (height - top - bottom); };

    std::string out = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"13\">\n"
        "<rect width=\"{}\" height=\"{}\" fill=\"white\"/>\n"
        "<text x=\"{}\" y=\"24\" font-size=\"16\">{}: rows reset (dashed) and read (solid)</text>\n",
        picture_width, height, picture_width, height, left, escaped_xml(title));
    const double unit = span > 2e6 ? 1e6 : 1e3;
    for (int i = 0; i <= 5; ++i) {
        const Time t = begin + static_cast<std::int64_t>(span * i / 5);
        out += fmt::format(
            "<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1}\" y2=\"{2}\" stroke=\"#ddd\"/><text x=\"{0:.1f}\" y=\"{3}\" text-anchor=\"middle\">{4:.6g}</text>\n",
            x(t), top, height - bottom, height - bottom + 18, static_cast<double>(t.ns) / unit);
        const double row = low + rows * i / 5;
        out += fmt::format("<text x=\"{}\" y=\"{:.1f}\" text-anchor=\"end\">{:.0f}</text>\n", left - 8,
                           y(row) + 4, row);
    }
    out += fmt::format(
        "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">time after the start of the first exposure, {}</text>\n"
        "<text x=\"16\" y=\"{}\" transform=\"rotate(-90 16 {})\" text-anchor=\"middle\">row of the array</text>\n",
        (left + picture_width - right) / 2, height - 16, unit > 1e5 ? "ms" : "us",
        (top + height - bottom) / 2, (top + height - bottom) / 2);
    for (std::size_t w = 0; w < plan.windows.size(); ++w) {
        const FrameWindow& window = plan.windows[w];
        const std::string_view colour = window_colours[w % std::size(window_colours)];
        std::string resets, reads, back;
        // Draw at most 500 points per line.
        std::int32_t step = std::max(1, window.sensor.height / 500);
        // Rows that alternate in time show it by odd steps.
        if (!in_order && step % 2 == 0) ++step;
        for (std::int32_t r = 0;; r = std::min(r + step, window.sensor.height - 1)) {
            const auto i = static_cast<std::size_t>(window.image_y + r);
            const double at = y(plan.sensor_row[i] + 0.5);
            resets += fmt::format("{:.2f},{:.2f} ", x(plan.rows[i].reset), at);
            reads += fmt::format("{:.2f},{:.2f} ", x(plan.rows[i].read), at);
            back = fmt::format("{:.2f},{:.2f} ", x(plan.rows[i].read), at) + back;
            if (r == window.sensor.height - 1) break;
        }
        out +=
            fmt::format("<polygon points=\"{0}{1}\" fill=\"{2}\" fill-opacity=\"0.15\"/>\n"
                        "<polyline points=\"{0}\" fill=\"none\" stroke=\"{2}\" stroke-dasharray=\"6 3\"/>\n"
                        "<polyline points=\"{3}\" fill=\"none\" stroke=\"{2}\" stroke-width=\"2\"/>\n",
                        resets, back, colour, reads);
    }
    return out + "</svg>\n";
}

} // namespace obscura::tools
