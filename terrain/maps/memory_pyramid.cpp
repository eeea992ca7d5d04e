// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/memory_pyramid.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::terrain {
namespace {

/// Edge of the smallest squares whose bounds are kept.
constexpr std::int64_t finest_square = 8;
/// Squares in a row that a query looks at, at most.
constexpr std::int64_t max_squares = 8;

constexpr SampleRange no_range{std::numeric_limits<float>::infinity(),
                               -std::numeric_limits<float>::infinity(), 0};

void widen(SampleRange& range, const SampleRange& other) {
    range.least = std::min(range.least, other.least);
    range.largest = std::max(range.largest, other.largest);
    range.largest_step = std::max(range.largest_step, other.largest_step);
}

} // namespace

MemoryPyramid::MemoryPyramid(std::int64_t width, std::int64_t height, std::vector<float> samples) {
    levels_.push_back({width, height, std::move(samples)});
    while (levels_.back().width > 1 || levels_.back().height > 1) {
        const Level& fine = levels_.back();
        // Share of a sample that the last column and row cover.
        const double scale = std::ldexp(1.0, static_cast<int>(levels_.size()) - 1);
        const double last_x = static_cast<double>(width) / scale - static_cast<double>(fine.width - 1);
        const double last_y = static_cast<double>(height) / scale - static_cast<double>(fine.height - 1);
        Level level{(fine.width + 1) / 2, (fine.height + 1) / 2, {}};
        level.samples.resize(static_cast<std::size_t>(level.width * level.height));
        for (std::int64_t y = 0; y < level.height; ++y)
            for (std::int64_t x = 0; x < level.width; ++x) {
                double sum = 0, weights = 0;
                for (std::int64_t j = 2 * y; j < std::min(2 * y + 2, fine.height); ++j)
                    for (std::int64_t i = 2 * x; i < std::min(2 * x + 2, fine.width); ++i) {
                        const float v = fine.samples[static_cast<std::size_t>(j * fine.width + i)];
                        if (std::isnan(v)) continue;
                        const double weight =
                            (i + 1 == fine.width ? last_x : 1) * (j + 1 == fine.height ? last_y : 1);
                        sum += weight * static_cast<double>(v);
                        weights += weight;
                    }
                level.samples[static_cast<std::size_t>(y * level.width + x)] =
                    weights > 0 ? static_cast<float>(sum / weights) : std::numeric_limits<float>::quiet_NaN();
            }
        levels_.push_back(std::move(level));
    }
    make_bounds();
}

std::uint64_t MemoryPyramid::bytes(std::int64_t width, std::int64_t height) {
    return static_cast<std::uint64_t>(width) * static_cast<std::uint64_t>(height) * sizeof(float) * 7 / 5;
}

void MemoryPyramid::make_bounds() {
    const Level& fine = levels_.front();
    Bounds first{(fine.width + finest_square - 1) / finest_square,
                 (fine.height + finest_square - 1) / finest_square,
                 {}};
    first.ranges.assign(static_cast<std::size_t>(first.width * first.height), no_range);
    for (std::int64_t y = 0; y < fine.height; ++y)
        for (std::int64_t x = 0; x < fine.width; ++x) {
            const float v = fine.samples[static_cast<std::size_t>(y * fine.width + x)];
            if (std::isnan(v)) {
                ++missing_;
                continue;
            }
            const auto step_to = [&](std::int64_t i, std::int64_t j) {
                if (i == fine.width || j == fine.height) return 0.0F;
                const float step = std::abs(fine.samples[static_cast<std::size_t>(j * fine.width + i)] - v);
                return std::isnan(step) ? std::numeric_limits<float>::infinity() : step;
            };
            widen(first.ranges[static_cast<std::size_t>(y / finest_square * first.width + x / finest_square)],
                  {v, v, std::max(step_to(x + 1, y), step_to(x, y + 1))});
        }
    bounds_.push_back(std::move(first));
    while (bounds_.back().width > 1 || bounds_.back().height > 1) {
        const Bounds& below = bounds_.back();
        Bounds above{(below.width + 1) / 2, (below.height + 1) / 2, {}};
        above.ranges.assign(static_cast<std::size_t>(above.width * above.height), no_range);
        for (std::int64_t y = 0; y < below.height; ++y)
            for (std::int64_t x = 0; x < below.width; ++x)
                widen(above.ranges[static_cast<std::size_t>(y / 2 * above.width + x / 2)],
                      below.ranges[static_cast<std::size_t>(y * below.width + x)]);
        bounds_.push_back(std::move(above));
    }
    least_ = bounds_.back().ranges[0].least;
    largest_ = bounds_.back().ranges[0].largest;
}

SampleRange MemoryPyramid::range(std::int64_t x, std::int64_t y, std::int64_t columns,
                                 std::int64_t rows) const {
    const std::int64_t x0 = std::clamp<std::int64_t>(x, 0, width(0) - 1);
    const std::int64_t y0 = std::clamp<std::int64_t>(y, 0, height(0) - 1);
    const std::int64_t x1 = std::clamp<std::int64_t>(x + columns - 1, x0, width(0) - 1);
    const std::int64_t y1 = std::clamp<std::int64_t>(y + rows - 1, y0, height(0) - 1);
    std::size_t level = 0;
    std::int64_t square = finest_square;
    while (level + 1 < bounds_.size() &&
           std::max(x1 / square - x0 / square, y1 / square - y0 / square) >= max_squares) {
        ++level;
        square *= 2;
    }
    const Bounds& bounds = bounds_[level];
    SampleRange range = no_range;
    for (std::int64_t j = y0 / square; j <= y1 / square; ++j)
        for (std::int64_t i = x0 / square; i <= x1 / square; ++i)
            widen(range, bounds.ranges[static_cast<std::size_t>(j * bounds.width + i)]);
    return range;
}

void MemoryPyramid::read(int level, std::int64_t x, std::int64_t y, int columns, int rows,
                         std::span<float> out) const {
    const Level& from = at(level);
    for (int j = 0; j < rows; ++j)
        std::copy_n(from.samples.begin() + static_cast<std::ptrdiff_t>((y + j) * from.width + x), columns,
                    out.begin() + static_cast<std::ptrdiff_t>(j) * columns);
}

} // namespace obscura::terrain
