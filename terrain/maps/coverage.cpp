// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/coverage.hpp"

#include "terrain/maps/memory_pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::terrain {
namespace {

/// Samples between the edge of the data and where distances begin.
constexpr double stencil_margin = 2;
constexpr std::int64_t max_cells = std::int64_t{1} << 22;

/// Distance to the nearest place where `far` is 0, along each row of the grid, in cells.
void along_row(float* row, std::int64_t columns, bool cyclic) {
    for (int turn = 0; turn < (cyclic ? 2 : 1); ++turn) {
        if (cyclic) row[0] = std::min(row[0], row[columns - 1] + 1);
        for (std::int64_t i = 1; i < columns; ++i)
            row[i] = std::min(row[i], row[i - 1] + 1);
    }
    for (int turn = 0; turn < (cyclic ? 2 : 1); ++turn) {
        if (cyclic) row[columns - 1] = std::min(row[columns - 1], row[0] + 1);
        for (std::int64_t i = columns - 2; i >= 0; --i)
            row[i] = std::min(row[i], row[i + 1] + 1);
    }
}

/// Lower envelope of parabolas (Felzenszwalb, Huttenlocher, Distance Transforms of Sampled Functions, 2012):
/// distances along rows become distances in the plane.
void along_columns(std::vector<float>& grid, std::int64_t columns, std::int64_t rows) {
    std::vector<double> f(static_cast<std::size_t>(rows)), border(static_cast<std::size_t>(rows) + 1);
    std::vector<std::int64_t> vertex(static_cast<std::size_t>(rows));
    for (std::int64_t i = 0; i < columns; ++i) {
        for (std::int64_t j = 0; j < rows; ++j) {
            const auto d = static_cast<double>(grid[static_cast<std::size_t>(j * columns + i)]);
            f[static_cast<std::size_t>(j)] = d * d;
        }
        std::size_t k = 0;
        vertex[0] = 0;
        border[0] = -std::numeric_limits<double>::infinity();
        border[1] = std::numeric_limits<double>::infinity();
        for (std::int64_t q = 1; q < rows; ++q) {
            const auto crossing = [&](std::int64_t v) {
                const auto x = static_cast<double>(q), y = static_cast<double>(v);
                return (f[static_cast<std::size_t>(q)] + x * x - f[static_cast<std::size_t>(v)] - y * y) /
                       (2 * (x - y));
            };
            double s = crossing(vertex[k]);
            while (s <= border[k])
                s = crossing(vertex[--k]);
            vertex[++k] = q;
            border[k] = s;
            border[k + 1] = std::numeric_limits<double>::infinity();
        }
        k = 0;
        for (std::int64_t q = 0; q < rows; ++q) {
            while (border[k + 1] < static_cast<double>(q))
                ++k;
            const auto away = static_cast<double>(q - vertex[k]);
            grid[static_cast<std::size_t>(q * columns + i)] =
                static_cast<float>(std::sqrt(away * away + f[static_cast<std::size_t>(vertex[k])]));
        }
    }
}

} // namespace

Coverage::Coverage(std::shared_ptr<const Raster> raster) : raster_(std::move(raster)) {
    if (raster_->samples().has_holes()) find_holes();
}

void Coverage::find_holes() {
    const SamplePyramid& samples = raster_->samples();
    int level = 0;
    while (level + 1 < samples.levels() && samples.width(level) * samples.height(level) > max_memory_samples)
        ++level;
    const std::int64_t width = samples.width(level), height = samples.height(level);
    std::int64_t step = 1;
    while (((width + step - 1) / step) * ((height + step - 1) / step) > max_cells)
        step *= 2;
    cell_ = std::ldexp(static_cast<double>(step), level);
    columns_ = (width + step - 1) / step;
    rows_ = (height + step - 1) / step;
    // Further than any cell, and small enough for exact squares in float.
    cells_.assign(static_cast<std::size_t>(columns_ * rows_), static_cast<float>(4 * (columns_ + rows_)));
    constexpr std::int64_t chunk = 4096;
    std::vector<float> line(static_cast<std::size_t>(std::min(chunk, width)));
    for (std::int64_t y = 0; y < height; ++y)
        for (std::int64_t x = 0; x < width; x += chunk) {
            const auto count = static_cast<int>(std::min(chunk, width - x));
            samples.read(level, x, y, count, 1, line);
            for (int i = 0; i < count; ++i)
                if (std::isnan(line[static_cast<std::size_t>(i)]))
                    cells_[static_cast<std::size_t>(y / step * columns_ + (x + i) / step)] = 0;
        }
    const bool cyclic = raster_->frame().period() > 0;
    for (std::int64_t j = 0; j < rows_; ++j)
        along_row(cells_.data() + j * columns_, columns_, cyclic);
    along_columns(cells_, columns_, rows_);
}

SamplePlace Coverage::to_sides(SamplePlace at) const {
    const MapFrame& frame = raster_->frame();
    const double edge = (frame.registration() == Registration::pixel ? 0.5 : 0) - stencil_margin;
    const auto last_x = static_cast<double>(frame.width() - 1),
               last_y = static_cast<double>(frame.height() - 1);
    SamplePlace to{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    if (frame.period() == 0) to.x = std::min(at.x, last_x - at.x) + edge;
    if (frame.period() == 0 || std::isnan(frame.first_pole_y())) to.y = at.y + edge;
    if (frame.period() == 0 || std::isnan(frame.last_pole_y())) to.y = std::min(to.y, last_y - at.y + edge);
    return to;
}

double Coverage::to_holes(SamplePlace at) const {
    if (cells_.empty()) return std::numeric_limits<double>::infinity();
    const double x = (at.x + 0.5) / cell_ - 0.5, y = (at.y + 0.5) / cell_ - 0.5;
    const bool cyclic = raster_->frame().period() > 0;
    const double left = std::floor(x), top = std::floor(y), t = x - left, u = y - top;
    const auto value = [&](double column, double row) {
        auto i = static_cast<std::int64_t>(column);
        i = cyclic ? (i + columns_) % columns_ : std::clamp<std::int64_t>(i, 0, columns_ - 1);
        const auto j = std::clamp<std::int64_t>(static_cast<std::int64_t>(row), 0, rows_ - 1);
        return static_cast<double>(cells_[static_cast<std::size_t>(j * columns_ + i)]);
    };
    const double cells = (1 - u) * ((1 - t) * value(left, top) + t * value(left + 1, top)) +
                         u * ((1 - t) * value(left, top + 1) + t * value(left + 1, top + 1));
    // From the middle of a cell to the corner of the one with the hole.
    return (cells - 0.71) * cell_ - stencil_margin;
}

double Coverage::distance(const Raster::Located& located) const {
    const SamplePlace at = located.place, density = located.density;
    if (!raster_->inside(at)) return 0;
    const SamplePlace sides = to_sides(at);
    const double nearest =
        std::min({sides.x / density.x, sides.y / density.y, to_holes(at) / std::max(density.x, density.y)});
    return std::max(nearest, 0.0);
}

double Coverage::min_distance(Vec3 p, double radius) const {
    const Raster::Area area = raster_->area(p, radius);
    if (area.all) return 0;
    const SamplePlace density = raster_->densities(p, radius).largest;
    const SamplePlace first = to_sides(area.least), last = to_sides(area.largest);
    const double across = std::hypot(area.largest.x - area.least.x, area.largest.y - area.least.y);
    const double holes = cells_.empty() ? std::numeric_limits<double>::infinity()
                                        : to_holes(raster_->frame().place(p)) - across;
    const double nearest =
        std::min({std::min(first.x, last.x) / density.x, std::min(first.y, last.y) / density.y,
                  holes / std::max(density.x, density.y)});
    return std::max(nearest, 0.0);
}

} // namespace obscura::terrain
