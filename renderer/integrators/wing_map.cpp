// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/wing_map.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace obscura::renderer {
namespace {

std::int32_t floor_index(double x) {
    return static_cast<std::int32_t>(std::floor(x));
}

std::int32_t floor_half(std::int32_t n) {
    return n >> 1;
}

std::int32_t floor_packet(std::int32_t n) {
    return n & ~(packet_size - 1);
}

/// Columns of the result that one pass holds in registers.
constexpr std::int32_t strip = 2 * packet_size;

/// out[i] += sum over k of kernel[k] source[i + 2 reach - k], k from `first` to `last`.
OBSCURA_VECTOR_CLONES
void convolve_strip(const float* kernel, std::int32_t first, std::int32_t last, const float* source,
                    float* out) {
    float sum[strip];
    for (std::int32_t i = 0; i < strip; ++i)
        sum[i] = out[i];
    for (std::int32_t k = first; k <= last; ++k) {
        const float weight = kernel[k];
        const float* from = source + (2 * WingKernels::reach - k);
        for (std::int32_t i = 0; i < strip; ++i)
            sum[i] += weight * from[i];
    }
    for (std::int32_t i = 0; i < strip; ++i)
        out[i] = sum[i];
}

OBSCURA_VECTOR_CLONES
void add_scaled(const float* from, float weight, std::int32_t count, float* sum) {
    for (std::int32_t i = 0; i < count; ++i)
        sum[i] += weight * from[i];
}

/// Adds `share` of what four nodes, from `at` on, give to every `places`-th pixel from `first`; the next
/// one's nodes are `step` further.
OBSCURA_VECTOR_CLONES
void add_place(const float (&across)[4], const float* at, std::int32_t step, double share, std::int32_t first,
               std::int32_t places, std::int32_t width, double* out) {
    for (std::int32_t i = first; i < width; i += places, at += step) {
        const float sum = across[0] * at[0] + across[1] * at[1] + across[2] * at[2] + across[3] * at[3];
        // Kernels of a limited band swing a little about 0 where there is no light.
        out[i] += share * static_cast<double>(sum > 0 ? sum : 0.0F);
    }
}

/// Weights of the four nodes about a point, `t` from the second towards the third.
void cubic_weights(double t, float (&weights)[4]) {
    const double s = 1 - t;
    weights[0] = static_cast<float>(s * s * s / 6);
    weights[1] = static_cast<float>(2.0 / 3 - t * t * (1 - t / 2));
    weights[2] = static_cast<float>(2.0 / 3 - s * s * (1 - s / 2));
    weights[3] = static_cast<float>(t * t * t / 6);
}

} // namespace

void GridRows::clear() {
    for (Row& row : rows_)
        row.stage = 0;
}

void GridRows::include(std::int32_t from, std::int32_t to) {
    if (rows_.empty()) first_ = from;
    if (from < first_) {
        rows_.insert(rows_.begin(), static_cast<std::size_t>(first_ - from), Row{});
        first_ = from;
    }
    const auto count = static_cast<std::size_t>(to - first_ + 1);
    if (count > rows_.size()) rows_.resize(count);
}

void WingMap::begin(Time time, std::int32_t first_x, std::int32_t width) {
    time_ = time;
    first_x_ = first_x;
    width_ = width;
    bodies_set_ = points_sorted_ = false;
    point_jobs_.clear();
    points_.clear();
    levels_.resize(kernels_.levels());
    std::int32_t from = floor_index(first_x / kernels_.cell_px(0)) - 1;
    std::int32_t to = floor_index((first_x + width - 1) / kernels_.cell_px(0)) + 2;
    for (Level& l : levels_) {
        l.first_column = floor_packet(from);
        l.columns = (floor_packet(to) + packet_size - l.first_column + strip - 1) / strip * strip;
        l.cells.clear();
        l.sources.clear();
        l.results.clear();
        from = floor_half(l.first_column) - 1;
        to = floor_half(l.first_column + l.columns - 1) + 1;
    }
}

void WingMap::sort_points() {
    std::erase_if(points_, [](const Point& p) { return p.from_level == never; });
    std::sort(points_.begin(), points_.end(),
              [](const Point& a, const Point& b) { return a.y != b.y ? a.y < b.y : a.order < b.order; });
    points_sorted_ = true;
}

void WingMap::plan(std::int32_t first_y, std::int32_t last_y) {
    constexpr std::int32_t reach = WingKernels::reach;
    cell_jobs_.clear();
    source_jobs_.clear();
    result_jobs_.clear();
    std::int32_t from = floor_index(first_y * psf_.aspect() / kernels_.cell_px(0)) - 1;
    std::int32_t to = floor_index(last_y * psf_.aspect() / kernels_.cell_px(0)) + 2;
    for (std::size_t i = 0; i < levels_.size(); ++i) {
        Level& l = levels_[i];
        l.results.include(from, to);
        std::int32_t first_missing = to + 1;
        std::int32_t last_missing = from - 1;
        for (std::int32_t j = from; j <= to; ++j)
            if (l.results.at(j).stage < 2) {
                result_jobs_.push_back({i, j});
                first_missing = std::min(first_missing, j);
                last_missing = j;
            }
        if (first_missing <= last_missing) {
            l.sources.include(first_missing - reach, last_missing + reach);
            l.cells.include(first_missing - reach - 1, last_missing + reach);
            for (std::int32_t j = first_missing - reach; j <= last_missing + reach; ++j)
                if (l.sources.at(j).stage == 0) source_jobs_.push_back({i, j});
            for (std::int32_t j = first_missing - reach - 1; j <= last_missing + reach; ++j)
                if (l.cells.at(j).stage == 0) cell_jobs_.push_back({i, j});
        }
        from = floor_half(from) - 1;
        to = floor_half(to) + 1;
    }
}

void WingMap::deposit_points(std::size_t level, std::int32_t row, float* sources) const {
    const Level& l = levels_[level];
    const double cell_px = kernels_.cell_px(level);
    const auto columns = static_cast<std::size_t>(source_columns(l));
    const auto before = [](const Point& p, double y) { return p.y < y; };
    auto point = std::lower_bound(points_.begin(), points_.end(), (row - 1) * cell_px, before);
    const auto end = std::lower_bound(point, points_.end(), (row + 1) * cell_px, before);
    for (; point != end; ++point) {
        if (point->from_level > static_cast<int>(level)) continue;
        const double down = 1 - std::abs(point->y / cell_px - row);
        const double u = point->x / cell_px - (l.first_column - margin);
        if (!(down > 0 && u >= 0 && u < static_cast<double>(columns - 1))) continue;
        const auto node = static_cast<std::size_t>(u);
        const double right = u - static_cast<double>(node);
        for (std::size_t c = 0; c < kernels_.channels(); ++c) {
            const double light = static_cast<double>(point->amount[c]) * down;
            sources[c * columns + node] += static_cast<float>(light * (1 - right));
            sources[c * columns + node + 1] += static_cast<float>(light * right);
        }
    }
}

void WingMap::gather(Job job) {
    Level& l = levels_[job.level];
    GridRows::Row& out = l.sources.at(job.row);
    const auto columns = static_cast<std::size_t>(source_columns(l));
    const std::size_t plane = kernels_.channels() * columns;
    const std::size_t zones = kernels_.zones();
    out.values.assign(zones * plane, 0.0F);
    const GridRows::Row& above = l.cells.at(job.row - 1);
    const GridRows::Row& below = l.cells.at(job.row);
    float* sum = out.values.data();
    if (above.lit > 0)
        for (std::size_t i = 0; i < plane; ++i)
            sum[i] = above.values[plane + i];
    if (below.lit > 0)
        for (std::size_t i = 0; i < plane; ++i)
            sum[i] += below.values[i];
    deposit_points(job.level, job.row, sum);
    // Find the columns with light.
    std::size_t first = columns;
    std::size_t last = 0;
    for (std::size_t i = 0; i < plane; ++i)
        if (sum[i] != 0) {
            first = std::min(first, i % columns);
            last = std::max(last, i % columns);
        }
    out.first_lit = static_cast<std::int32_t>(first);
    out.lit = first <= last ? static_cast<std::int32_t>(last - first) + 1 : 0;
    // Divide the light among the field positions; the first one's part is in place of the sum.
    if (zones > 1 && out.lit > 0) {
        const double cell_px = kernels_.cell_px(job.level);
        for (std::size_t i = first; i <= last; ++i) {
            const PsfZones at =
                psf_.zones_at((l.first_column - margin + static_cast<std::int32_t>(i)) * cell_px,
                              job.row * cell_px / psf_.aspect());
            for (std::size_t c = 0; c < kernels_.channels(); ++c) {
                const float light = std::exchange(sum[c * columns + i], 0.0F);
                for (int k = 0; k < 4; ++k)
                    sum[at.zone[k] * plane + c * columns + i] += light * static_cast<float>(at.share[k]);
            }
        }
    }
    out.stage = 1;
}

void WingMap::convolve(Job job) {
    constexpr std::int32_t reach = WingKernels::reach;
    Level& l = levels_[job.level];
    GridRows::Row& out = l.results.at(job.row);
    if (out.stage > 0) return;
    const auto columns = static_cast<std::size_t>(source_columns(l));
    const std::size_t plane = kernels_.channels() * columns;
    const auto width = static_cast<std::size_t>(l.columns);
    out.values.assign(kernels_.channels() * width, 0.0F);
    // Kernels are symmetric: rows at equal distances are added first.
    for (std::int32_t j = 0; j <= reach; ++j) {
        const GridRows::Row& above = l.sources.at(job.row - j);
        const GridRows::Row& below = l.sources.at(job.row + j);
        const auto half =
            static_cast<std::int32_t>(std::sqrt((reach + 0.5) * (reach + 0.5) - static_cast<double>(j * j)));
        for (std::int32_t s = 0; s < l.columns; s += strip) {
            const std::int32_t from = s + margin - reach;
            const auto lit = [&](const GridRows::Row& row) {
                return row.lit > 0 && row.first_lit <= s + margin + strip - 1 + half &&
                       row.first_lit + row.lit - 1 >= s + margin - half;
            };
            const bool lit_above = lit(above);
            const bool lit_below = j > 0 && lit(below);
            if (!lit_above && !lit_below) continue;
            for (std::size_t zone = 0; zone < kernels_.zones(); ++zone)
                for (std::size_t c = 0; c < kernels_.channels(); ++c) {
                    const std::size_t at = zone * plane + c * columns + static_cast<std::size_t>(from);
                    float source[strip + 2 * reach];
                    for (std::size_t i = 0; i < std::size(source); ++i)
                        source[i] = (lit_above ? above.values[at + i] : 0.0F) +
                                    (lit_below ? below.values[at + i] : 0.0F);
                    convolve_strip(kernels_.kernel(job.level, zone, c) + (reach - j) * WingKernels::side,
                                   reach - half, reach + half, source, out.values.data() + c * width + s);
                }
        }
    }
    out.stage = 1;
}

void WingMap::add_level_above(Job job, std::vector<float>& scratch) {
    Level& l = levels_[job.level];
    GridRows::Row& out = l.results.at(job.row);
    if (out.stage > 1) return;
    if (job.level + 1 < levels_.size()) {
        // Cubic B-splines refine: 1 6 1 at the nodes of the level above, 4 4 between them, over 8.
        const Level& above = levels_[job.level + 1];
        const auto from_width = static_cast<std::size_t>(above.columns);
        const auto width = static_cast<std::size_t>(l.columns);
        const std::int32_t middle = floor_half(job.row);
        const bool odd = (job.row & 1) != 0;
        scratch.resize(from_width);
        for (std::size_t c = 0; c < kernels_.channels(); ++c) {
            std::fill(scratch.begin(), scratch.end(), 0.0F);
            const auto add = [&](std::int32_t row, float weight) {
                add_scaled(above.results.at(row).values.data() + c * from_width, weight, above.columns,
                           scratch.data());
            };
            if (odd) {
                add(middle, 0.5F);
                add(middle + 1, 0.5F);
            } else {
                add(middle - 1, 0.125F);
                add(middle, 0.75F);
                add(middle + 1, 0.125F);
            }
            float* to = out.values.data() + c * width;
            const float* at = scratch.data() + (floor_half(l.first_column) - above.first_column);
            for (std::size_t i = 0; i < width; i += 2, ++at) {
                to[i] += 0.125F * (at[-1] + at[1]) + 0.75F * at[0];
                to[i + 1] += 0.5F * (at[0] + at[1]);
            }
        }
    }
    out.stage = 2;
}

void WingMap::add(std::int32_t y, double share, std::int32_t first_x, std::int32_t width,
                  std::vector<double>& light, std::vector<float>& scratch) const {
    const Level& l = levels_[0];
    const double cell_px = kernels_.cell_px(0);
    const double v = y * psf_.aspect() / cell_px;
    const std::int32_t row = floor_index(v);
    float down[4];
    cubic_weights(v - row, down);
    const auto columns = static_cast<std::size_t>(l.columns);
    scratch.resize(columns);
    for (std::size_t c = 0; c < kernels_.channels(); ++c) {
        std::fill(scratch.begin(), scratch.end(), 0.0F);
        for (std::int32_t k = 0; k < 4; ++k)
            add_scaled(l.results.at(row - 1 + k).values.data() + c * columns, down[k], l.columns,
                       scratch.data());
        double* out = light.data() + c * static_cast<std::size_t>(width);
        // Sides of cells are powers of two: the weights of pixels repeat from cell to cell.
        const auto places = static_cast<std::int32_t>(std::max(1.0, cell_px));
        for (std::int32_t place = 0; place < places; ++place) {
            float across[4];
            cubic_weights(place / std::max(1.0, cell_px), across);
            // The first pixel at that place of a cell.
            const std::int32_t first = (place - first_x % places + 2 * places) % places;
            if (first >= width) continue;
            const std::int32_t step = cell_px < 1 ? static_cast<std::int32_t>(1 / cell_px) : 1;
            const std::int32_t node = floor_index((first_x + first) / cell_px);
            add_place(across, scratch.data() + (node - 1 - l.first_column), step, share, first, places, width,
                      out);
        }
    }
}

} // namespace obscura::renderer
