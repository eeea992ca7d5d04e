// SPDX-License-Identifier: Apache-2.0
// Plots as SVG with round ticks, linear or logarithmic axes, legend and marks.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace obscura::tools {

enum class Drawn : std::uint8_t { points, line, dashed, bars };

/// Points of one kind. Values that are not finite, and those not above zero on a logarithmic axis, are left
/// out.
struct PlotSeries {
    std::string name; ///< in the legend; empty: not there
    Drawn drawn = Drawn::points;
    std::vector<std::pair<double, double>> points;
};

/// Labelled line across the plot.
struct PlotMark {
    double at = 0;
    std::string label;
    bool horizontal = false;
};

struct Plot {
    std::string title, x_label, y_label;
    bool log_x = false, log_y = false;
    std::vector<PlotSeries> series;
    std::vector<PlotMark> marks;
};

/// One self-contained <svg> element.
[[nodiscard]] std::string svg(const Plot& plot);
/// The plots below each other as one <svg> element.
[[nodiscard]] std::string svg(const std::vector<Plot>& plots);

} // namespace obscura::tools
