// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/slope_levels.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace obscura::terrain {
namespace {

/// Slopes at the samples of a row, along columns and rows; NaN where one of the samples is missing.
struct SlopeRow {
    std::vector<double> along_x, along_y;
};

} // namespace

SlopeLevels::SlopeLevels(const SamplePyramid& samples, const MapFrame& frame)
    : shift_(samples.levels_of_nodes() ? 0 : 0.5), turns_(frame.period() > 0) {
    if (samples.width(0) * samples.height(0) > max_samples) return;
    for (int k = 0; k < samples.levels() && samples.width(k) >= edge && samples.height(k) >= edge; ++k) {
        Level level;
        level.scale = std::ldexp(1.0, k);
        level.columns = (samples.width(k) + edge - 1) / edge;
        level.rows = (samples.height(k) + edge - 1) / edge;
        const auto blocks = static_cast<std::size_t>(level.columns * level.rows);
        level.whole.resize(blocks);
        level.kept.resize(blocks);
        add_slopes(samples, frame, k, level);
        if (k > 0) { // the finest slopes of the blocks that are one now
            const Level& finer = levels_.back();
            for (std::int64_t j = 0; j < finer.rows; ++j)
                for (std::int64_t i = 0; i < finer.columns; ++i) {
                    const Sum& from = finer.whole[static_cast<std::size_t>(j * finer.columns + i)];
                    const std::int64_t to_i = std::min(i / 2, level.columns - 1),
                                       to_j = std::min(j / 2, level.rows - 1);
                    Sum& to = level.whole[static_cast<std::size_t>(to_j * level.columns + to_i)];
                    to.value += from.value;
                    to.count += from.count;
                }
        }
        levels_.push_back(std::move(level));
    }
    for (Level& level : levels_) {
        const auto mean = [](const Sum& sum) { return sum.count > 0 ? sum.value / sum.count : 0.0; };
        for (std::size_t n = 0; n < level.whole.size(); ++n)
            level.lost.push_back(
                static_cast<float>(std::max(0.0, mean(level.whole[n]) - mean(level.kept[n]))));
        level.whole = level.kept = {};
    }
}

void SlopeLevels::add_slopes(const SamplePyramid& samples, const MapFrame& frame, int k, Level& level) const {
    const std::int64_t width = samples.width(k), height = samples.height(k);
    const auto count = static_cast<std::size_t>(width);
    // Rows j - 1, j and j + 1, and the slopes of rows j - 1 and j.
    std::array<std::vector<float>, 3> lines;
    std::array<SlopeRow, 2> slopes;
    const auto read = [&](std::int64_t j, std::vector<float>& line) {
        line.resize(count);
        samples.read(k, 0, j, static_cast<int>(width), 1, line);
    };
    read(0, lines[1]);
    read(1, lines[2]);
    for (std::int64_t j = 1; j + 1 < height; ++j) {
        std::rotate(lines.begin(), lines.begin() + 1, lines.end());
        read(j + 1, lines[2]);
        std::swap(slopes[0], slopes[1]);
        slopes[1].along_x.assign(count, std::numeric_limits<double>::quiet_NaN());
        slopes[1].along_y = slopes[1].along_x;
        Sum* const whole = level.whole.data() + j / edge * level.columns;
        Sum* const kept = level.kept.data() + j / edge * level.columns;
        for (std::int64_t block = 0; block < level.columns; ++block) {
            const std::int64_t first = block * edge, last = std::min(first + edge, width);
            const double middle = (static_cast<double>(first + last - 1) / 2 + shift_) * level.scale - shift_;
            const SamplePlace place{middle, (static_cast<double>(j) + shift_) * level.scale - shift_};
            const SamplePlace per = frame.samples_per_radian(frame.position(place));
            const double rows = per.y / level.scale;
            const auto step = static_cast<std::int64_t>(
                std::clamp(std::nearbyint(per.x / per.y), 1.0, static_cast<double>(width / 4)));
            const double columns = per.x / level.scale / static_cast<double>(step);
            if (!std::isfinite(columns)) continue;
            for (std::int64_t i = first; i < last; ++i) {
                std::int64_t before = i - step, after = i + step;
                if (turns_) {
                    before = (before + width) % width;
                    after %= width;
                }
                if (before < 0 || after >= width) continue;
                const auto n = static_cast<std::size_t>(i);
                const auto value = [](const std::vector<float>& line, std::int64_t at) {
                    return static_cast<double>(line[static_cast<std::size_t>(at)]);
                };
                const double here = value(lines[1], i);
                const double x = (value(lines[1], after) - value(lines[1], before)) * columns / 2;
                const double y = (value(lines[2], i) - value(lines[0], i)) * rows / 2;
                slopes[1].along_x[n] = x;
                slopes[1].along_y[n] = y;
                if (k == 0) {
                    const double a = (value(lines[1], after) - here) * columns,
                                 b = (value(lines[2], i) - here) * rows;
                    if (!std::isnan(a + b)) {
                        whole[block].value += a * a + b * b;
                        whole[block].count += 1;
                    }
                }
                // The mean over a cell of what is linear between its vertices: see kept_squared_slope().
                if (j < 2 || before >= i) continue;
                const auto p = static_cast<std::size_t>(before);
                const auto sum = [&](const std::vector<double>& now, const std::vector<double>& above) {
                    return (4 * now[n] * now[n] + 2 * now[n] * now[p] + 2 * now[n] * above[n] +
                            now[n] * above[p]) /
                           9;
                };
                const double squared =
                    sum(slopes[1].along_x, slopes[0].along_x) + sum(slopes[1].along_y, slopes[0].along_y);
                if (std::isnan(squared)) continue;
                kept[block].value += squared;
                kept[block].count += 1;
            }
        }
    }
}

double SlopeLevels::at(const Level& level, SamplePlace place) const {
    const auto blocks = [&](double x) {
        return ((x + shift_) / level.scale - shift_ + 0.5) / static_cast<double>(edge) - 0.5;
    };
    const double x = blocks(place.x),
                 y = std::clamp(blocks(place.y), 0.0, static_cast<double>(level.rows - 1));
    const double left = std::floor(x), top = std::min(std::floor(y), static_cast<double>(level.rows - 1));
    const double s = x - left, r = y - top;
    const auto value = [&](std::int64_t i, std::int64_t j) {
        i = turns_ ? (i % level.columns + level.columns) % level.columns
                   : std::clamp<std::int64_t>(i, 0, level.columns - 1);
        j = std::min(j, level.rows - 1);
        return static_cast<double>(level.lost[static_cast<std::size_t>(j * level.columns + i)]);
    };
    const auto i = static_cast<std::int64_t>(left), j = static_cast<std::int64_t>(top);
    return (1 - r) * ((1 - s) * value(i, j) + s * value(i + 1, j)) +
           r * ((1 - s) * value(i, j + 1) + s * value(i + 1, j + 1));
}

double SlopeLevels::lost(SamplePlace place, double rows) const {
    if (levels_.empty()) return 0;
    // Where cells are small, the loss goes as their area.
    if (rows < 1) return rows * rows * at(levels_.front(), place);
    const double most = static_cast<double>(levels_.size() - 1);
    const double blend = std::min(std::log2(rows), most), whole = std::floor(blend), share = blend - whole;
    const auto k = static_cast<std::size_t>(whole);
    const double fine = at(levels_[k], place);
    return share > 0 ? fine + share * (at(levels_[k + 1], place) - fine) : fine;
}

} // namespace obscura::terrain
