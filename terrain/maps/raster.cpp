// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/raster.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace obscura::terrain {
namespace {

/// Blocks have this many samples along an edge, and further ones around so that each stencil of four by four
/// lies in one block.
constexpr int block_bits = 6;
constexpr std::int64_t block_cells = std::int64_t{1} << block_bits;
constexpr std::int64_t block_edge = block_cells + 3;
/// About 9 MB.
constexpr std::size_t most_blocks = 512;

/// Levels are used down to this many samples along an edge.
constexpr std::int64_t least_samples = 4;
/// Largest stretch of the cubic: along rows and where there is no full turn, in samples, and along a full
/// turn. Beyond 0.6 rad, a parallel beside the pole is no straight line any more.
constexpr double most_stretch = 64, most_turn = 0.1;
/// The weights of stretched and plain cubics across have absolute sums of up to 1.2688 and 1.25: a value
/// exceeds its samples by at most (1.2688 * 1.25 - 1) / 2 of their range.
constexpr double overshoot = 0.2931;
/// Where samples are missing, the sum of the weights that are left may be this share of the whole.
constexpr double least_weight = 0.75;
constexpr double overshoot_at_holes = ((2 * overshoot + 1) / least_weight - 1) / 2;

constexpr float nan_sample = std::numeric_limits<float>::quiet_NaN();

/// Weights of four samples at -1, 0, 1, 2 for the place `t`, 0 to 1.
std::array<double, 4> catmull_rom(double t) {
    const double t2 = t * t, t3 = t2 * t;
    return {-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1, -1.5 * t3 + 2 * t2 + 0.5 * t,
            0.5 * t3 - 0.5 * t2};
}

/// The same as one function of the distance.
double cubic(double distance) {
    const double t = std::abs(distance);
    if (t >= 2) return 0;
    return t < 1 ? (1.5 * t - 2.5) * t * t + 1 : ((-0.5 * t + 2.5) * t - 4) * t + 2;
}

std::int64_t floor_mod(std::int64_t value, std::int64_t divisor) {
    const std::int64_t r = value % divisor;
    return r < 0 ? r + divisor : r;
}

/// How an axis of a level ends.
enum class End : std::uint8_t {
    edge,   ///< nothing follows
    seam,   ///< the first sample follows
    mirror, ///< the samples follow in reverse order, beyond a pole
};

/// Place along an axis of `count` samples of which the last covers only the share `last`: means of areas lie
/// in the middle of what they cover, so that the last one is nearer to its neighbours; a node is where it is,
/// and only what follows is nearer.
double warped(double x, std::int64_t count, double last, End end, bool nodes) {
    const auto n = static_cast<double>(count);
    if (last >= 1) return x;
    if (end == End::seam && x < 0) x += n - 1 + last; // between the last sample and the first
    if (nodes) return x <= n - 1 || end != End::seam ? x : n - 1 + (x - (n - 1)) / last;
    if (x <= n - 2) return x;
    const double middle = n - 1 - 0.5 * (1 - last); // of the last sample
    if (x <= middle || end == End::seam) return n - 2 + (x - (n - 2)) * 2 / (1 + last);
    return end == End::mirror ? n - 1 + (x - middle) / last : n - 1 + (x - middle);
}

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

Raster::Raster(std::shared_ptr<const SamplePyramid> samples, const MapFrame& frame)
    : samples_(std::move(samples)), frame_(frame) {
    if (samples_->width(0) != frame.width() || samples_->height(0) != frame.height())
        throw std::invalid_argument(fmt::format("{} x {} samples in a map of {} x {}", samples_->width(0),
                                                samples_->height(0), frame.width(), frame.height()));
    if (frame.period() > 0) {
        period_ = std::llround(frame.period());
        if (std::abs(frame.period() - static_cast<double>(period_)) > 2e-3 || period_ > frame.width())
            throw std::invalid_argument(fmt::format(
                "a full turn of longitude is {:.6f} columns, which is no whole number", frame.period()));
        first_pole_ = !std::isnan(frame.first_pole_y());
        last_pole_ = !std::isnan(frame.last_pole_y());
    }
    const auto share = [](double size) { return size - std::ceil(size) + 1; };
    for (int k = 0; k < samples_->levels(); ++k) {
        Level level{};
        level.scale = std::ldexp(1.0, k);
        const double columns = static_cast<double>(period_ > 0 ? period_ : frame.width()) / level.scale;
        const double rows = static_cast<double>(frame.height()) / level.scale;
        level.width = static_cast<std::int64_t>(std::ceil(columns));
        level.height = static_cast<std::int64_t>(std::ceil(rows));
        level.last_x = share(columns);
        level.last_y = share(rows);
        if (k > 0 && (level.width < least_samples || level.height < least_samples)) break;
        levels_.push_back(level);
    }
    for (int k = 0; k < static_cast<int>(levels_.size()); ++k) {
        Level& at = levels_[static_cast<std::size_t>(k)];
        if (first_pole_) at.first_mean = row_mean(k, 0);
        if (last_pole_) at.last_mean = row_mean(k, at.height - 1);
    }
}

double Raster::row_mean(int k, std::int64_t row) const {
    const std::int64_t columns = level(k).width;
    std::array<float, 4096> samples;
    double sum = 0;
    for (std::int64_t i = 0; i < columns;) {
        const auto count = static_cast<int>(std::min<std::int64_t>(samples.size(), columns - i));
        samples_->read(k, i, row, count, 1, {samples.data(), static_cast<std::size_t>(count)});
        for (int c = 0; c < count; ++c)
            sum += static_cast<double>(samples[static_cast<std::size_t>(c)]);
        i += count;
    }
    return sum / static_cast<double>(columns);
}

bool Raster::whole() const {
    return period_ > 0 && first_pole_ && last_pole_ && !samples_->has_holes();
}

bool Raster::inside(SamplePlace at) const {
    const double edge = frame_.registration() == Registration::pixel ? 0.5 : 0;
    const double rounding = 1e-6;
    const auto within = [&](double x, std::int64_t count) {
        return x >= -edge - rounding && x <= static_cast<double>(count - 1) + edge + rounding;
    };
    return (period_ > 0 || within(at.x, frame_.width())) && within(at.y, frame_.height());
}

Raster::Area Raster::area(Vec3 centre, double radius) const {
    const Area all{{}, {}, true};
    const Projection& projection = frame_.projection();
    const PixelTransform& t = frame_.transform();
    const SamplePlace middle = frame_.place(centre);
    if (projection.kind == ProjectionKind::simple_cylindrical) {
        const double latitude = std::atan2(centre.z, std::hypot(centre.x, centre.y));
        const double low = latitude - radius, high = latitude + radius;
        const auto row = [&](double l) { return frame_.place({std::cos(l), 0, std::sin(l)}).y; };
        constexpr double pole = std::numbers::pi / 2;
        const double first = row(std::clamp(low, -pole, pole)), last = row(std::clamp(high, -pole, pole));
        Area area{{0, std::min(first, last)}, {static_cast<double>(frame_.width()), std::max(first, last)}};
        if (high >= pole || low <= -pole) return area;
        const double turn = projection.turn_m() / std::abs(t[1]);
        const double half = std::asin(std::min(1.0, std::sin(radius) / std::cos(latitude)));
        const double columns = half / (2 * std::numbers::pi) * turn;
        // Beyond half a turn from its middle, a part of the body is nearer from the other side.
        const double from_middle = std::abs(middle.x - 0.5 * static_cast<double>(frame_.width() - 1));
        if (period_ == 0 && from_middle + columns >= 0.5 * turn) return area;
        area.least.x = middle.x - columns;
        area.largest.x = middle.x + columns;
        return area;
    }
    double half_m = radius;
    MapPoint on_map = projection.forward(centre);
    if (projection.kind != ProjectionKind::planar) {
        // The conformal map of a circle of a sphere is a circle about a point of the same meridian.
        const double sign = projection.kind == ProjectionKind::north_polar_stereographic ? 1 : -1;
        const double across = std::hypot(centre.x, centre.y);
        const double colatitude = std::atan2(across, sign * centre.z);
        if (!(colatitude + radius < 2.8)) return all;
        const Vec3 meridian = across > 0 ? Vec3{centre.x / across, centre.y / across, 0} : Vec3{1, 0, 0};
        const auto at = [&](double angle) {
            return projection.forward(
                {std::sin(angle) * meridian.x, std::sin(angle) * meridian.y, sign * std::cos(angle)});
        };
        const MapPoint near = at(colatitude - radius), far = at(colatitude + radius);
        on_map = {0.5 * (near.x_m + far.x_m), 0.5 * (near.y_m + far.y_m)};
        // Latitudes of a spheroid differ from those of a sphere.
        half_m = 1.02 * 0.5 * std::hypot(far.x_m - near.x_m, far.y_m - near.y_m);
    }
    const double determinant = t[1] * t[5] - t[2] * t[4];
    const double offset = frame_.registration() == Registration::pixel ? 0.5 : 0;
    const double dx = on_map.x_m - t[0], dy = on_map.y_m - t[3];
    const SamplePlace at{(dx * t[5] - dy * t[2]) / determinant - offset,
                         (dy * t[1] - dx * t[4]) / determinant - offset};
    const double columns = half_m * (std::abs(t[5]) + std::abs(t[2])) / std::abs(determinant);
    const double rows = half_m * (std::abs(t[1]) + std::abs(t[4])) / std::abs(determinant);
    return {{at.x - columns, at.y - rows}, {at.x + columns, at.y + rows}};
}

Raster::Densities Raster::densities(Vec3 centre, double radius) const {
    const SamplePlace middle = frame_.samples_per_radian(centre);
    Densities found{middle, middle};
    if (frame_.projection().kind == ProjectionKind::planar) return found;
    // They grow or fall along meridians from pole to pole or equator.
    const double across = std::hypot(centre.x, centre.y), latitude = std::atan2(centre.z, across);
    const Vec3 meridian = across > 0 ? Vec3{centre.x / across, centre.y / across, 0} : Vec3{1, 0, 0};
    constexpr double pole = std::numbers::pi / 2;
    const double low = std::max(latitude - radius, -pole), high = std::min(latitude + radius, pole);
    for (const double l : {low, high, std::clamp(0.0, low, high)}) {
        const Vec3 p{std::cos(l) * meridian.x, std::cos(l) * meridian.y, std::sin(l)};
        const SamplePlace there = frame_.samples_per_radian(p);
        found.least = {std::min(found.least.x, there.x), std::min(found.least.y, there.y)};
        found.largest = {std::max(found.largest.x, there.x), std::max(found.largest.y, there.y)};
    }
    return found;
}

SampleRange Raster::range(const Area& area, Vec3 centre, double radius, double footprint) const {
    const auto width = static_cast<double>(frame_.width()), height = static_cast<double>(frame_.height());
    const SamplePlace density = densities(centre, radius).largest;
    // Half of a cubic of the coarser level, and the samples that its outer ones are means of.
    const double across = footprint > 0 ? density.x * footprint : 0; // at a pole pixels have no width
    const double margin_x = std::min(6 * std::max(1.0, across) + 2, 2 * width);
    const double margin_y = std::min(6 * std::max(1.0, density.y * footprint) + 2, 2 * height);
    double x0 = area.least.x - margin_x, x1 = area.largest.x + margin_x;
    double y0 = area.least.y - margin_y, y1 = area.largest.y + margin_y;
    if (area.all) {
        x0 = y0 = 0;
        x1 = width;
        y1 = height;
    }
    if (y1 < 0 || y0 > height - 1 || (period_ == 0 && (x1 < 0 || x0 > width - 1)))
        return {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
    // Beyond a pole the samples are those of other longitudes.
    if (period_ > 0 && ((first_pole_ && y0 < 0) || (last_pole_ && y1 > height - 1))) {
        x0 = 0;
        x1 = width;
    }
    const auto block = [&](double from, double to) {
        const double left = std::clamp(std::floor(from), 0.0, width - 1);
        const double right = std::clamp(std::ceil(to), 0.0, width - 1);
        const double top = std::clamp(std::floor(y0), 0.0, height - 1);
        const double bottom = std::clamp(std::ceil(y1), 0.0, height - 1);
        return samples_->range(static_cast<std::int64_t>(left), static_cast<std::int64_t>(top),
                               static_cast<std::int64_t>(right - left) + 1,
                               static_cast<std::int64_t>(bottom - top) + 1);
    };
    SampleRange range = block(x0, x1);
    const auto turn = static_cast<double>(period_);
    if (period_ > 0 && (x0 < 0 || x1 > turn - 1)) {
        const SampleRange other = x1 - x0 >= turn ? block(0, width)
                                  : x0 < 0        ? block(x0 + turn, width)
                                                  : block(0, x1 - turn);
        range = {std::min(range.least, other.least), std::max(range.largest, other.largest)};
    }
    const auto over = static_cast<float>(
        overshoot * (static_cast<double>(range.largest) - static_cast<double>(range.least)));
    if (!(range.least <= range.largest)) return range;
    return {std::nextafter(range.least - over, -std::numeric_limits<float>::infinity()),
            std::nextafter(range.largest + over, std::numeric_limits<float>::infinity())};
}

std::int64_t Raster::stored_row(int k, std::int64_t row, bool& beyond_pole) const {
    beyond_pole = false;
    const std::int64_t rows = level(k).height;
    // A reduced level that holds means has the pole half a sample before its first row, one of nodes on it.
    const bool nodes = samples_->levels_of_nodes();
    if (row < 0 && first_pole_) {
        beyond_pole = true;
        row = k == 0 ? std::llround(2 * frame_.first_pole_y()) - row : (nodes ? 0 : -1) - row;
    } else if (row >= rows && last_pole_) {
        beyond_pole = true;
        const bool on_pole = nodes && (frame_.height() - 1) % (std::int64_t{1} << k) == 0;
        row = k == 0 ? std::llround(2 * frame_.last_pole_y()) - row : 2 * rows - (on_pole ? 2 : 1) - row;
    }
    return std::clamp<std::int64_t>(row, 0, rows - 1);
}

// Columns from `column` on, which may lie beyond the raster: across its seam, beyond a pole or, where it has
// an edge, with the outermost column again.
void Raster::Reader::read_row(int k, std::int64_t column, std::int64_t row, int count, float* out) {
    const Raster& raster = raster_;
    const std::int64_t columns = raster.level(k).width;
    bool beyond_pole = false;
    const std::int64_t from = raster.stored_row(k, row, beyond_pole);
    const auto read = [&](std::int64_t first, int wanted, float* to) {
        raster.samples_->read(k, first, from, wanted, 1, {to, static_cast<std::size_t>(wanted)});
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

void Raster::Reader::fill(int k, std::int64_t block_x, std::int64_t block_y, Block& block) {
    const Level& level = raster_.level(k);
    block.samples.assign(static_cast<std::size_t>(block_edge * block_edge), nan_sample);
    const std::int64_t left = block_x * block_cells - 1, top = block_y * block_cells - 1;
    if (left >= 0 && top >= 0 && left + block_edge <= level.width && top + block_edge <= level.height)
        return raster_.samples_->read(k, left, top, static_cast<int>(block_edge),
                                      static_cast<int>(block_edge), block.samples);
    for (std::int64_t j = 0; j < block_edge; ++j)
        read_row(k, left, top + j, static_cast<int>(block_edge),
                 block.samples.data() + static_cast<std::ptrdiff_t>(j * block_edge));
}

const float* Raster::Reader::stencil(int k, std::int64_t column, std::int64_t row) {
    const std::int64_t block_x = (column + 1) >> block_bits, block_y = (row + 1) >> block_bits;
    const std::uint64_t key = static_cast<std::uint64_t>(k) << 58 |
                              static_cast<std::uint64_t>(block_y + 2) << 29 |
                              static_cast<std::uint64_t>(block_x + 2);
    if (key != last_key_) {
        if (blocks_.size() > most_blocks) blocks_.clear();
        const auto [at, fresh] = blocks_.try_emplace(key);
        if (fresh) {
            last_key_ = ~std::uint64_t{0};
            fill(k, block_x, block_y, at->second);
        }
        last_ = &at->second;
        last_key_ = key;
    }
    const std::int64_t i = column + 1 - block_x * block_cells, j = row + 1 - block_y * block_cells;
    return last_->samples.data() + static_cast<std::ptrdiff_t>(j * block_edge + i);
}

// Four by four samples at index coordinates.
double Raster::Reader::narrow(int k, double x, double y) {
    const double left = std::floor(x), top = std::floor(y);
    const double t = x - left, u = y - top;
    auto column = static_cast<std::int64_t>(left);
    if (raster_.period_ > 0) column = floor_mod(column, raster_.level(k).width);
    const float* const s = stencil(k, column - 1, static_cast<std::int64_t>(top) - 1);
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
double Raster::Reader::wide(int k, double x, double y, double stretch_x, double stretch_y) {
    const Level& level = raster_.level(k);
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
            const std::int64_t column = raster_.period_ > 0 ? floor_mod(i, level.width)
                                                            : std::clamp<std::int64_t>(i, 0, level.width - 1);
            // Samples of one block, one after the other.
            const float* const s = stencil(k, column, j);
            std::int64_t run = 1;
            if (raster_.period_ > 0 || (i >= 0 && i < level.width))
                run = std::min(
                    {block_cells - floor_mod(column + 1, block_cells), end_x - i + 1, level.width - column});
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
    return weights > least_weight * whole ? sum / weights : narrow(k, x, y);
}

double Raster::Reader::level_value(int k, SamplePlace place, double stretch_x, double stretch_y) {
    const Level& level = raster_.level(k);
    const bool nodes = raster_.samples_->levels_of_nodes();
    const double shift = nodes ? 0 : 0.5;
    const double x = warped((place.x + shift) / level.scale - shift, level.width, level.last_x,
                            raster_.period_ > 0 ? End::seam : End::edge, nodes);
    const double y = warped((place.y + shift) / level.scale - shift, level.height, level.last_y,
                            raster_.last_pole_ ? End::mirror : End::edge, nodes);
    double value = 0;
    if (stretch_x <= 1 && stretch_y <= 1) {
        value = narrow(k, x, y);
    } else {
        const double most =
            raster_.period_ > 0 ? std::max(1.0, most_turn * static_cast<double>(level.width)) : most_stretch;
        value = wide(k, x, y, std::clamp(stretch_x, 1.0, most), std::clamp(stretch_y, 1.0, most_stretch));
    }
    // The nearest row around a pole has many values at one point: within half a row of the pole the surface
    // goes over to their mean.
    const auto towards = [&](double mean, double rows) {
        if (!(rows < 0.5) || std::isnan(mean)) return;
        const double t = 2 * std::max(rows, 0.0);
        value = mean + (value - mean) * t * t * (3 - 2 * t);
    };
    const MapFrame& frame = raster_.frame_;
    if (raster_.first_pole_) towards(level.first_mean, (place.y - frame.first_pole_y()) / level.scale);
    if (raster_.last_pole_) towards(level.last_mean, (frame.last_pole_y() - place.y) / level.scale);
    return value;
}

double Raster::Reader::sample(const Located& located, double footprint) {
    const SamplePlace place = located.place, density = located.density;
    if (!raster_.inside(place)) return std::numeric_limits<double>::quiet_NaN();
    // At a pole pixels have no width.
    const double columns = footprint > 0 ? density.x * footprint : 0, rows = density.y * footprint;
    if (columns <= 1 && rows <= 1) return level_value(0, place, 1, 1);
    const double most = static_cast<double>(raster_.levels_.size() - 1);
    const double blend = std::min(std::log2(std::max(1.0, std::min(columns, rows))), most);
    const double whole = std::floor(blend), share = blend - whole;
    const double scale = std::exp2(-blend);
    const auto k = static_cast<int>(whole);
    const double fine = level_value(k, place, columns * scale, rows * scale);
    if (share == 0 || std::isnan(fine)) return fine;
    const double coarse = level_value(k + 1, place, columns * scale, rows * scale);
    return std::isnan(coarse) ? fine : fine + share * (coarse - fine);
}

bool Raster::Reader::plain(SamplePlace place, SamplePlace density, double footprint) const {
    if (!raster_.inside(place)) return false;
    if (footprint > 0 && !(density.x * footprint <= 1 && density.y * footprint <= 1)) return false;
    const MapFrame& frame = raster_.frame_;
    return !(raster_.first_pole_ && place.y - frame.first_pole_y() < 0.5) &&
           !(raster_.last_pole_ && frame.last_pole_y() - place.y < 0.5);
}

void Raster::Reader::sample(const MapBlock& block, std::span<const double> footprints,
                            std::span<double> out) {
    static constexpr std::array<float, static_cast<std::size_t>(4 * block_edge)> nothing{};
    // None is thrown out while others are looked up.
    if (blocks_.size() + map_block_size > most_blocks) {
        blocks_.clear();
        last_key_ = ~std::uint64_t{0};
    }
    StencilBlock stencils;
    std::array<std::uint8_t, map_block_size> others;
    std::size_t other_count = 0;
    const double shift = raster_.samples_->levels_of_nodes() ? 0 : 0.5;
    const std::int64_t width = raster_.level(0).width;
    for (std::size_t n = 0; n < map_block_size; ++n) {
        stencils.first[n] = reinterpret_cast<std::int64_t>(nothing.data());
        stencils.t[n] = stencils.u[n] = 0;
        if (n >= block.count) continue;
        const SamplePlace place{block.place_x[n], block.place_y[n]};
        if (!plain(place, {block.density_x[n], block.density_y[n]}, footprints[n])) {
            others[other_count++] = static_cast<std::uint8_t>(n);
            continue;
        }
        const double x = (place.x + shift) - shift, y = (place.y + shift) - shift;
        const double left = std::floor(x), top = std::floor(y);
        auto column = static_cast<std::int64_t>(left);
        if (raster_.period_ > 0 && (column < 0 || column >= width)) column = floor_mod(column, width);
        stencils.first[n] =
            reinterpret_cast<std::int64_t>(stencil(0, column - 1, static_cast<std::int64_t>(top) - 1));
        stencils.t[n] = x - left;
        stencils.u[n] = y - top;
    }
    alignas(64) std::array<double, map_block_size> values;
    if (other_count < block.count)
        sample_stencils(stencils, block.count, static_cast<std::size_t>(block_edge), values);
    for (std::size_t n = 0; n < block.count; ++n)
        if (std::isnan(values[n]) && plain({block.place_x[n], block.place_y[n]},
                                           {block.density_x[n], block.density_y[n]}, footprints[n]))
            others[other_count++] = static_cast<std::uint8_t>(n);
    for (std::size_t n = 0; n < block.count; ++n)
        out[n] = values[n];
    for (std::size_t k = 0; k < other_count; ++k) {
        const std::size_t n = others[k];
        out[n] = sample({{block.place_x[n], block.place_y[n]}, {block.density_x[n], block.density_y[n]}},
                        footprints[n]);
    }
}

double Raster::Reader::bilinear(Vec3 p) {
    const SamplePlace place = raster_.frame_.place(p);
    if (!raster_.inside(place)) return std::numeric_limits<double>::quiet_NaN();
    const double left = std::floor(place.x), top = std::floor(place.y);
    const double t = place.x - left, u = place.y - top;
    auto column = static_cast<std::int64_t>(left);
    if (raster_.period_ > 0) column = floor_mod(column, raster_.period_);
    const float* const s = stencil(0, column - 1, static_cast<std::int64_t>(top) - 1) + block_edge + 1;
    const auto value = [&](std::ptrdiff_t i) { return static_cast<double>(s[i]); };
    return (1 - u) * ((1 - t) * value(0) + t * value(1)) +
           u * ((1 - t) * value(block_edge) + t * value(block_edge + 1));
}

} // namespace obscura::terrain
