// SPDX-License-Identifier: Apache-2.0
#include "tools/model/projection_pictures.hpp"

#include "core/units.hpp"
#include "tools/pictures/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

namespace obscura::tools {
namespace {

constexpr double angle_step_deg = 10, azimuth_step_deg = 30;

double pixel_angle_mrad(const ProjectedPoints& points, std::size_t i) {
    return 1e3 * std::sqrt(std::fabs(points.solid_angle[i]));
}

/// Where lines of the grid are: the step changes from a pixel to the next ones.
bool on_line(const ProjectedPoints& points, std::size_t i, std::size_t beside, std::size_t below) {
    for (const std::size_t other : {beside, below}) {
        if (!points.sees(other)) continue;
        const auto ring = [&](std::size_t k) { return std::floor(points.angle_deg(k) / angle_step_deg); };
        const auto sector = [&](std::size_t k) {
            return std::floor(points.azimuth_deg(k) / azimuth_step_deg);
        };
        if (ring(i) != ring(other) || sector(i) != sector(other)) return true;
    }
    return false;
}

/// Image points of directions of one angle or of one azimuth.
PlotSeries image_of_line(const models::ProjectionProgram& projection,
                         const std::vector<std::pair<double, double>>& angles) {
    const std::size_t lanes = (angles.size() + models::Program::lane_step - 1) / models::Program::lane_step *
                              models::Program::lane_step;
    std::array<std::vector<double>, 5> rows;
    for (std::vector<double>& row : rows)
        row.assign(lanes, 1);
    for (std::size_t i = 0; i < angles.size(); ++i) {
        const auto [angle, azimuth] = angles[i];
        rows[0][i] = std::sin(angle * degree) * std::cos(azimuth * degree);
        rows[1][i] = std::sin(angle * degree) * std::sin(azimuth * degree);
        rows[2][i] = std::cos(angle * degree);
    }
    projection.project({rows[0].data(), rows[1].data(), rows[2].data()}, rows[3].data(), rows[4].data(),
                       lanes);
    const models::SensorPlane& plane = projection.plane();
    PlotSeries series;
    series.drawn = Drawn::line;
    for (std::size_t i = 0; i < angles.size(); ++i) {
        const double x = rows[3][i], y = rows[4][i];
        if (x >= -0.5 && x <= plane.width - 0.5 && y >= -0.5 && y <= plane.height - 0.5)
            series.points.emplace_back(x, -y);
    }
    return series;
}

Plot grid_plot(const models::ProjectionProgram& projection, std::string_view title) {
    Plot plot;
    plot.title = fmt::format("{}: angles to the boresight every {:g} deg", title, angle_step_deg);
    plot.x_label = "column, px";
    plot.y_label = "row, px (negative: down)";
    for (double angle = angle_step_deg; angle < 180; angle += angle_step_deg) {
        std::vector<std::pair<double, double>> circle;
        for (int k = 0; k <= 180; ++k)
            circle.emplace_back(angle, 2.0 * k);
        PlotSeries series = image_of_line(projection, circle);
        if (series.points.size() < 2) continue;
        // A circle that leaves the sensor has gaps: as points.
        if (series.points.size() < circle.size()) series.drawn = Drawn::points;
        series.name = fmt::format("{:g} deg", angle);
        plot.series.push_back(std::move(series));
    }
    return plot;
}

} // namespace

ProjectedPoints::ProjectedPoints(const models::ProjectionProgram& projection, std::vector<double> columns,
                                 std::vector<double> rows)
    : x(std::move(columns)), y(std::move(rows)) {
    const std::size_t count = x.size();
    const std::size_t lanes =
        (count + models::Program::lane_step - 1) / models::Program::lane_step * models::Program::lane_step;
    x.resize(lanes);
    y.resize(lanes);
    dx = dy = dz = solid_angle = residual_px = x;
    projection.rays(x.data(), y.data(), {dx.data(), dy.data(), dz.data()}, solid_angle.data(), lanes);
    std::vector<double> back_x(x), back_y(y);
    projection.project({dx.data(), dy.data(), dz.data()}, back_x.data(), back_y.data(), lanes);
    for (std::size_t i = 0; i < lanes; ++i)
        residual_px[i] = std::hypot(back_x[i] - x[i], back_y[i] - y[i]);
    for (std::vector<double>* row : {&x, &y, &dx, &dy, &dz, &solid_angle, &residual_px})
        row->resize(count);
}

double ProjectedPoints::angle_deg(std::size_t i) const {
    return std::atan2(std::hypot(dx[i], dy[i]), dz[i]) / degree;
}

double ProjectedPoints::azimuth_deg(std::size_t i) const {
    return std::atan2(dy[i], dx[i]) / degree;
}

Canvas projection_maps(const models::ProjectionProgram& projection) {
    const models::SensorPlane& plane = projection.plane();
    const double scale = 256.0 / std::max(plane.width, plane.height);
    const auto width = std::max(8, static_cast<std::int32_t>(plane.width * scale));
    const auto height = std::max(8, static_cast<std::int32_t>(plane.height * scale));
    // With a column and a row more, for differences.
    std::vector<double> columns, rows;
    for (std::int32_t y = 0; y <= height; ++y)
        for (std::int32_t x = 0; x <= width; ++x) {
            columns.push_back(-0.5 + (x + 0.5) * plane.width / width);
            rows.push_back(-0.5 + (y + 0.5) * plane.height / height);
        }
    const ProjectedPoints points(projection, columns, rows);
    double low = std::numeric_limits<double>::infinity(), high = 0, widest = 1;
    for (std::size_t i = 0; i < columns.size(); ++i) {
        if (!points.sees(i)) continue;
        low = std::min(low, pixel_angle_mrad(points, i));
        high = std::max(high, pixel_angle_mrad(points, i));
        widest = std::max(widest, points.angle_deg(i));
    }
    Panel grid, map;
    grid.title = fmt::format("lines every {:g} deg", angle_step_deg);
    map.title = "angle of a pixel";
    ColourScale angles, sizes;
    angles.high = widest;
    angles.label = "deg";
    sizes.map = ColourMap::viridis;
    sizes.low = high - low > 1e-9 * high ? low : low * 0.999;
    sizes.high = high > 0 ? high : 1;
    sizes.label = "mrad";
    for (Panel* panel : {&grid, &map}) {
        panel->width = width;
        panel->height = height;
    }
    for (std::int32_t y = 0; y < height; ++y)
        for (std::int32_t x = 0; x < width; ++x) {
            const auto i = static_cast<std::size_t>(y * (width + 1) + x);
            const double none = std::numeric_limits<double>::quiet_NaN();
            const bool line =
                points.sees(i) && on_line(points, i, i + 1, i + static_cast<std::size_t>(width) + 1);
            grid.pixels.push_back(line ? Rgb{255, 200, 60}
                                       : angles.colour_of(points.sees(i) ? points.angle_deg(i) : none));
            map.pixels.push_back(sizes.colour_of(points.sees(i) ? pixel_angle_mrad(points, i) : none));
        }
    grid.scale = angles;
    map.scale = sizes;
    return draw_panels({std::move(grid), std::move(map)});
}

std::string projection_svg(const models::ProjectionProgram& projection, std::string_view title) {
    const models::SensorPlane& plane = projection.plane();
    Plot sizes, residuals;
    sizes.title = fmt::format("{}: angle of a pixel", title);
    sizes.y_label = "mrad";
    residuals.title = fmt::format("{}: image point of a ray less that of its pixel", title);
    residuals.y_label = "px";
    residuals.log_y = true;
    for (Plot* plot : {&sizes, &residuals})
        plot->x_label = "angle to the boresight, deg";
    const std::array<std::pair<std::string_view, std::array<double, 2>>, 4> ways{
        {{"right", {1, 0}}, {"left", {-1, 0}}, {"down", {0, 1}}, {"up", {0, -1}}}};
    for (const auto& [name, way] : ways) {
        std::vector<double> columns, rows;
        for (int k = 1; k <= 128; ++k) {
            columns.push_back((plane.width - 1) / 2.0 + way[0] * plane.width / 2.0 * k / 128);
            rows.push_back((plane.height - 1) / 2.0 + way[1] * plane.height / 2.0 * k / 128);
        }
        const ProjectedPoints points(projection, columns, rows);
        PlotSeries size{std::string(name), Drawn::line, {}}, residual{std::string(name), Drawn::points, {}};
        for (std::size_t i = 0; i < columns.size(); ++i) {
            if (!points.sees(i)) continue;
            size.points.emplace_back(points.angle_deg(i), pixel_angle_mrad(points, i));
            residual.points.emplace_back(points.angle_deg(i), std::max(points.residual_px[i], 1e-16));
        }
        sizes.series.push_back(std::move(size));
        residuals.series.push_back(std::move(residual));
    }
    return svg(std::vector{grid_plot(projection, title), std::move(sizes), std::move(residuals)});
}

std::string projection_csv(const models::ProjectionProgram& projection) {
    const models::SensorPlane& plane = projection.plane();
    std::vector<double> columns, rows;
    for (int y = 0; y <= 32; ++y)
        for (int x = 0; x <= 32; ++x) {
            columns.push_back(-0.5 + plane.width * x / 32.0);
            rows.push_back(-0.5 + plane.height * y / 32.0);
        }
    const ProjectedPoints points(projection, columns, rows);
    std::string text = "x_px,y_px,direction_x,direction_y,direction_z,solid_angle_sr,residual_px\n";
    for (std::size_t i = 0; i < columns.size(); ++i)
        if (points.sees(i))
            fmt::format_to(std::back_inserter(text), "{},{},{:.17g},{:.17g},{:.17g},{:.17g},{:.3g}\n",
                           columns[i], rows[i], points.dx[i], points.dy[i], points.dz[i],
                           std::fabs(points.solid_angle[i]), points.residual_px[i]);
    return text;
}

} // namespace obscura::tools
