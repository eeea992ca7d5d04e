// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/cubic.hpp"
#include "terrain/maps/raster.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

namespace obscura::terrain {
namespace {

/// Blocks have this many columns, and further ones around so that each stencil of four by four lies in one
/// block.
constexpr int block_bits = 6;
constexpr std::int64_t block_cells = std::int64_t{1} << block_bits;
constexpr std::int64_t block_edge = block_cells + 3;
/// Rows of a block, as a power of two: fewer where each of its columns is many.
constexpr int row_bits(int halvings) {
    return halvings == 0 ? block_bits : 4;
}
/// About 9 MB.
constexpr std::size_t max_read_blocks = 512;
/// Largest stretch of the cubic, in samples.
constexpr double max_stretch = 64;
/// Where samples are missing, the sum of the weights that are left may be this share of the whole.
constexpr double min_weight = 0.75;

constexpr float nan_sample = std::numeric_limits<float>::quiet_NaN();

/// Fills in missing ones of four samples by their nearest neighbour; false: both middle ones are missing.
bool completed(std::array<double, 4>& v) {
    if (std::isnan(v[1]) && std::isnan(v[2])) return false;
    if (std::isnan(v[1])) v[1] = v[2];
    if (std::isnan(v[2])) v[2] = v[1];
    if (std::isnan(v[0])) v[0] = v[1];
    if (std::isnan(v[3])) v[3] = v[2];
    return true;
}

/// A stencil with samples missing.
double patched(const float* s, const std::array<double, 4>& across, const std::array<double, 4>& down,
               double t, double u) {
    const std::size_t nearest =
        (t < 0.5 ? 1U : 2U) + (u < 0.5 ? 1U : 2U) * static_cast<std::size_t>(block_edge);
    if (std::isnan(s[nearest])) return std::numeric_limits<double>::quiet_NaN();
    std::array<double, 4> rows{};
    for (std::size_t j = 0; j < 4; ++j) {
        std::array<double, 4> v{};
        for (std::size_t i = 0; i < 4; ++i)
            v[i] = static_cast<double>(s[j * static_cast<std::size_t>(block_edge) + i]);
        rows[j] = completed(v) ? across[0] * v[0] + across[1] * v[1] + across[2] * v[2] + across[3] * v[3]
                               : std::numeric_limits<double>::quiet_NaN();
    }
    if (!completed(rows)) return std::numeric_limits<double>::quiet_NaN();
    return down[0] * rows[0] + down[1] * rows[1] + down[2] * rows[2] + down[3] * rows[3];
}

} // namespace

Raster::Reader::Columns Raster::Reader::columns(int k, int halvings) const {
    const Level& level = raster_.level(k);
    return {k, halvings, halvings == 0 ? level.width : level.thinned.count(halvings)};
}

void Raster::Reader::read_stored(const Columns& of, std::int64_t first, std::int64_t row, int count,
                                 float* out) {
    const SamplePyramid& samples = *raster_.samples_;
    const std::span<float> values(out, static_cast<std::size_t>(count));
    if (of.halvings == 0) return samples.read(of.level, first, row, count, 1, values);
    const ThinnedRows& thinned = raster_.level(of.level).thinned;
    const ThinnedRows::Span source = thinned.source(of.count, first, count);
    line_.resize(static_cast<std::size_t>(source.count));
    samples.read(of.level, source.first, row, static_cast<int>(source.count), 1, line_);
    thinned.thin(of.count, first, line_, values);
}

// Columns from `column` on, which may lie beyond the raster: across its seam, beyond a pole or, where it has
// an edge, with the outermost column again.
void Raster::Reader::read_row(const Columns& of, std::int64_t column, std::int64_t row, int count,
                              float* out) {
    const Raster& raster = raster_;
    const std::int64_t columns = of.count;
    bool beyond_pole = false;
    const std::int64_t from = raster.stored_row(of.level, row, beyond_pole);
    const auto read = [&](std::int64_t first, int wanted, float* to) {
        read_stored(of, first, from, wanted, to);
    };
    if (raster.period_ == 0) {
        const std::int64_t left = std::clamp<std::int64_t>(column, 0, columns - 1);
        const std::int64_t right = std::clamp<std::int64_t>(column + count - 1, 0, columns - 1);
        const std::int64_t begin = std::clamp<std::int64_t>(left - column, 0, count - 1);
        const auto wanted = static_cast<int>(std::min(right - left + 1, count - begin));
        read(left, wanted, out + begin);
        std::fill(out, out + begin, out[begin]);
        std::fill(out + begin + wanted, out + count, out[begin + wanted - 1]);
        return;
    }
    const auto cyclic = [&](std::int64_t first, float* to) {
        for (int done = 0; done < count;) {
            const std::int64_t at = floor_mod(first + done, columns);
            const auto wanted = static_cast<int>(std::min<std::int64_t>(count - done, columns - at));
            if (done >= columns)
                std::copy_n(to + done - columns, wanted, to + done);
            else
                read(at, wanted, to + done);
            done += wanted;
        }
    };
    if (!beyond_pole) return cyclic(column, out);
    cyclic(column + columns / 2, out);
    if (columns % 2 == 0) return;
    std::array<float, static_cast<std::size_t>(block_edge)> other{};
    cyclic(column + columns / 2 + 1, other.data());
    for (int i = 0; i < count; ++i)
        out[i] = 0.5F * (out[i] + other[static_cast<std::size_t>(i)]);
}

void Raster::Reader::fill(const Columns& of, std::int64_t block_x, std::int64_t block_y, Block& block) {
    const Level& level = raster_.level(of.level);
    const std::int64_t rows = std::int64_t{1} << row_bits(of.halvings), edge = rows + 3;
    block.samples.assign(static_cast<std::size_t>(edge * block_edge), nan_sample);
    const std::int64_t left = block_x * block_cells - 1, top = block_y * rows - 1;
    if (of.halvings == 0 && left >= 0 && top >= 0 && left + block_edge <= level.width &&
        top + edge <= level.height)
        return raster_.samples_->read(of.level, left, top, static_cast<int>(block_edge),
                                      static_cast<int>(edge), block.samples);
    for (std::int64_t j = 0; j < edge; ++j) {
        const auto row =
            std::span(block.samples)
                .subspan(static_cast<std::size_t>(j * block_edge), static_cast<std::size_t>(block_edge));
        if (of.halvings == 0) {
            read_row(of, left, top + j, static_cast<int>(block_edge), row.data());
            continue;
        }
        std::array<float, static_cast<std::size_t>(block_edge) + 2> means;
        read_row(of, left - 1, top + j, static_cast<int>(block_edge) + 2, means.data());
        level.thinned.sharpen(of.count, means, row);
    }
}

const float* Raster::Reader::stencil(const Columns& of, std::int64_t column, std::int64_t row) {
    const int bits = row_bits(of.halvings);
    const std::int64_t block_x = (column + 1) >> block_bits, block_y = (row + 1) >> bits;
    const std::uint64_t key =
        static_cast<std::uint64_t>(of.level) << 58 | static_cast<std::uint64_t>(of.halvings) << 53 |
        static_cast<std::uint64_t>(block_y + 2) << 26 | static_cast<std::uint64_t>(block_x + 2);
    // Columns and wider ones are asked for in turn.
    Last& last = last_[static_cast<std::size_t>(of.halvings % 2)];
    if (key != last.key) {
        if (blocks_.size() > max_read_blocks) forget();
        const auto [at, fresh] = blocks_.try_emplace(key);
        if (fresh) try {
                fill(of, block_x, block_y, at->second);
            } catch (...) {
                blocks_.erase(at);
                throw;
            }
        last = {key, at->second.samples.data()};
    }
    const std::int64_t i = column + 1 - block_x * block_cells, j = row + 1 - (block_y << bits);
    return last.samples + static_cast<std::ptrdiff_t>(j * block_edge + i);
}

void Raster::Reader::forget() {
    blocks_.clear();
    last_ = {};
}

// Four by four samples at index coordinates.
double Raster::Reader::narrow(const Columns& of, double x, double y) {
    const double left = std::floor(x), top = std::floor(y);
    const double t = x - left, u = y - top;
    auto column = static_cast<std::int64_t>(left);
    if (raster_.period_ > 0) column = floor_mod(column, of.count);
    const float* const s = stencil(of, column - 1, static_cast<std::int64_t>(top) - 1);
    const std::array<double, 4> across = catmull_rom(t), down = catmull_rom(u);
    double sum = 0;
    for (std::size_t j = 0; j < 4; ++j) {
        const float* const line = s + j * static_cast<std::size_t>(block_edge);
        sum +=
            down[j] * (across[0] * static_cast<double>(line[0]) + across[1] * static_cast<double>(line[1]) +
                       across[2] * static_cast<double>(line[2]) + across[3] * static_cast<double>(line[3]));
    }
    return std::isnan(sum) ? patched(s, across, down, t, u) : sum;
}

// As many samples as the stretched cubics cover.
double Raster::Reader::wide(const Columns& of, double x, double y, double stretch_x, double stretch_y) {
    const auto begin_x = static_cast<std::int64_t>(std::ceil(x - 2 * stretch_x));
    const auto end_x = static_cast<std::int64_t>(std::floor(x + 2 * stretch_x));
    const auto begin_y = static_cast<std::int64_t>(std::ceil(y - 2 * stretch_y));
    const auto end_y = static_cast<std::int64_t>(std::floor(y + 2 * stretch_y));
    double sum = 0, weights = 0, missing = 0;
    across_.clear();
    for (std::int64_t i = begin_x; i <= end_x; ++i)
        across_.push_back(cubic((static_cast<double>(i) - x) / stretch_x));
    for (std::int64_t j = begin_y; j <= end_y; ++j) {
        const double down = cubic((static_cast<double>(j) - y) / stretch_y);
        if (down == 0) continue;
        for (std::int64_t i = begin_x; i <= end_x;) {
            const std::int64_t column =
                raster_.period_ > 0 ? floor_mod(i, of.count) : std::clamp<std::int64_t>(i, 0, of.count - 1);
            // Samples of one block, one after the other.
            const float* const s = stencil(of, column, j);
            std::int64_t run = 1;
            if (raster_.period_ > 0 || (i >= 0 && i < of.count))
                run = std::min(
                    {block_cells - floor_mod(column + 1, block_cells), end_x - i + 1, of.count - column});
            for (std::int64_t r = 0; r < run; ++r) {
                const double weight = down * across_[static_cast<std::size_t>(i + r - begin_x)];
                if (std::isnan(s[r]))
                    missing += std::abs(weight);
                else {
                    sum += weight * static_cast<double>(s[r]);
                    weights += weight;
                }
            }
            i += run;
        }
    }
    if (missing == 0) return sum / weights;
    // With many samples missing the cubic's own weights are of no use.
    const double whole = stretch_x * stretch_y;
    return weights > min_weight * whole ? sum / weights : narrow(of, x, y);
}

double Raster::Reader::level_value(int k, SamplePlace place, double stretch_x, double stretch_y) {
    const Level& level = raster_.level(k);
    const double x = raster_.level_column(k, place.x), y = raster_.level_row(k, place.y);
    const auto value_of = [&](const Columns& of, double at, double stretch) {
        if (stretch <= 1 && stretch_y <= 1) return narrow(of, at, y);
        return wide(of, at, y, std::clamp(stretch, 1.0, max_stretch),
                    std::clamp(stretch_y, 1.0, max_stretch));
    };
    if (!raster_.cylindrical_) return value_of(columns(k, 0), x, stretch_x);
    const auto thinned = [&](int halvings) {
        const Columns of = columns(k, halvings);
        return value_of(of, halvings == 0 ? x : raster_.thinned_column(k, place.x, of.count), 1);
    };
    const Halvings halvings = Raster::halvings(stretch_x, level.thinned.most());
    double value = thinned(halvings.whole);
    if (halvings.share > 0) {
        const double wider = thinned(halvings.whole + 1);
        if (!std::isnan(wider)) value += halvings.share * (wider - value);
    }
    const MapFrame& frame = raster_.frame_;
    const auto towards = [&](const PolarCap& cap, double rows) {
        const double distance = std::max(rows, 0.0), share = cap.exists() ? cap.share(distance) : 0;
        if (share > 0) value += share * (cap.at(distance, raster_.level_turn(k, place.x)) - value);
    };
    towards(level.first_cap, (place.y - frame.first_pole_y()) / level.scale);
    towards(level.last_cap, (frame.last_pole_y() - place.y) / level.scale);
    return value;
}

double Raster::Reader::sample(const Located& located, double footprint) {
    const SamplePlace place = located.place, density = located.density;
    if (!raster_.inside(place)) return std::numeric_limits<double>::quiet_NaN();
    const double columns = raster_.columns_of(density, footprint), rows = density.y * footprint;
    if (rows <= 1 && (columns <= 1 || raster_.cylindrical_)) return level_value(0, place, columns, 1);
    const double most = static_cast<double>(raster_.levels_.size() - 1);
    const double blend = std::min(std::log2(std::max(1.0, std::min(columns, rows))), most);
    const double whole = std::floor(blend), share = blend - whole;
    const double scale = std::exp2(-blend);
    const auto k = static_cast<int>(whole);
    // Columns are put together exactly; cubics are stretched by what the levels leave.
    const auto across = [&](int level) {
        return columns * (raster_.cylindrical_ ? std::ldexp(1.0, -level) : scale);
    };
    const double fine = level_value(k, place, across(k), rows * scale);
    if (share == 0 || std::isnan(fine)) return fine;
    const double coarse = level_value(k + 1, place, across(k + 1), rows * scale);
    return std::isnan(coarse) ? fine : fine + share * (coarse - fine);
}

bool Raster::Reader::plain(SamplePlace place, double rows) const {
    if (!(rows <= 1) || !raster_.inside(place)) return false;
    const MapFrame& frame = raster_.frame_;
    return !(raster_.first_pole_ && place.y - frame.first_pole_y() < PolarCap::max_reach) &&
           !(raster_.last_pole_ && frame.last_pole_y() - place.y < PolarCap::max_reach);
}

void Raster::Reader::sample(const MapBlock& block, std::span<const double> footprints,
                            std::span<double> out) {
    static constexpr std::array<float, static_cast<std::size_t>(4 * block_edge)> nothing{};
    // None is thrown out while others are looked up.
    if (blocks_.size() + 2 * map_block_size > max_read_blocks) forget();
    // Stencils of columns, and of the wider ones that these are blended with.
    StencilBlock stencils, wider;
    std::array<double, map_block_size> shares, rows, tops;
    std::array<std::uint8_t, map_block_size> others;
    std::size_t other_count = 0;
    bool blends = false;
    const int most = raster_.level(0).thinned.most();
    const auto look_up = [&](StencilBlock& to, std::size_t n, int halvings) {
        const SamplePlace place{block.place_x[n], block.place_y[n]};
        const Columns of = columns(0, halvings);
        const double x =
            halvings == 0 ? raster_.level_column(0, place.x) : raster_.thinned_column(0, place.x, of.count);
        const double left = std::floor(x);
        auto column = static_cast<std::int64_t>(left);
        if (raster_.period_ > 0 && (column < 0 || column >= of.count)) column = floor_mod(column, of.count);
        to.first[n] =
            reinterpret_cast<std::int64_t>(stencil(of, column - 1, static_cast<std::int64_t>(tops[n]) - 1));
        to.t[n] = x - left;
        to.u[n] = rows[n] - tops[n];
    };
    for (std::size_t n = 0; n < map_block_size; ++n) {
        for (StencilBlock* const s : {&stencils, &wider}) {
            s->first[n] = reinterpret_cast<std::int64_t>(nothing.data());
            s->t[n] = s->u[n] = 0;
        }
        shares[n] = 0;
        if (n >= block.count) continue;
        const SamplePlace density{block.density_x[n], block.density_y[n]};
        const double columns = raster_.columns_of(density, footprints[n]);
        if (!plain({block.place_x[n], block.place_y[n]}, density.y * footprints[n]) ||
            !(columns <= 1 || raster_.cylindrical_)) {
            others[other_count++] = static_cast<std::uint8_t>(n);
            continue;
        }
        rows[n] = raster_.level_row(0, block.place_y[n]);
        tops[n] = std::floor(rows[n]);
        const Halvings halvings = Raster::halvings(columns, most);
        look_up(stencils, n, halvings.whole);
        if (halvings.share == 0) continue;
        look_up(wider, n, halvings.whole + 1);
        shares[n] = halvings.share;
        blends = true;
    }
    alignas(64) std::array<double, map_block_size> values, wide_values;
    const auto edge = static_cast<std::size_t>(block_edge);
    if (other_count < block.count) sample_stencils(stencils, block.count, edge, values);
    if (blends) {
        sample_stencils(wider, block.count, edge, wide_values);
        for (std::size_t n = 0; n < block.count; ++n)
            if (shares[n] > 0) values[n] += shares[n] * (wide_values[n] - values[n]);
    }
    std::array<bool, map_block_size> other{};
    for (std::size_t k = 0; k < other_count; ++k)
        other[others[k]] = true;
    for (std::size_t n = 0; n < block.count; ++n) {
        // Missing samples are looked at one by one.
        out[n] =
            other[n] || std::isnan(values[n])
                ? sample({{block.place_x[n], block.place_y[n]}, {block.density_x[n], block.density_y[n]}},
                         footprints[n])
                : values[n];
    }
}

double Raster::Reader::bilinear(Vec3 p) {
    const SamplePlace place = raster_.frame_.place(p);
    if (!raster_.inside(place)) return std::numeric_limits<double>::quiet_NaN();
    const double left = std::floor(place.x), top = std::floor(place.y);
    const double t = place.x - left, u = place.y - top;
    auto column = static_cast<std::int64_t>(left);
    if (raster_.period_ > 0) column = floor_mod(column, raster_.period_);
    const float* const s =
        stencil(columns(0, 0), column - 1, static_cast<std::int64_t>(top) - 1) + block_edge + 1;
    const auto value = [&](std::ptrdiff_t i) { return static_cast<double>(s[i]); };
    return (1 - u) * ((1 - t) * value(0) + t * value(1)) +
           u * ((1 - t) * value(block_edge) + t * value(block_edge + 1));
}

} // namespace obscura::terrain
