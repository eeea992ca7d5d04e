// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/raster.hpp"

#include "terrain/detail/exact_math.hpp"
#include "terrain/maps/cubic.hpp"
#include "terrain/maps/cubic_bounds.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>

namespace obscura::terrain {
namespace {

/// Levels are used down to this many samples along an edge.
constexpr std::int64_t min_samples = 4;
/// Columns are taken together where they are more than this many times as close to each other as rows are.
constexpr double max_aspect = 3;
/// Columns that are taken together for an aspect; in the end so many that they are 3/4 as far apart as rows.
double columns_for(double aspect) {
    return aspect > max_aspect ? 0.75 * aspect - max_aspect * (0.75 * max_aspect - 1) / aspect : 1;
}

/// The weights of stretched and plain cubics across have absolute sums of up to 1.2688 and 1.25: a value
/// exceeds its samples by at most (1.2688 * 1.25 - 1) / 2 of their range.
constexpr double raster_overshoot = 0.2931;
/// Overshoot of columns that are taken together.
constexpr double overshoot_of_thinned = (1.2688 * ThinnedRows::max_weight - 1) / 2;

/// Cells along the edge of the largest part whose cubics are looked at one by one.
constexpr int max_cubic_cells = 14;

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
        if (k > 0 && (level.width < min_samples || level.height < min_samples)) break;
        levels_.push_back(level);
    }
    cylindrical_ = frame.projection().kind == ProjectionKind::simple_cylindrical;
    for (int k = 0; cylindrical_ && k < static_cast<int>(levels_.size()); ++k) {
        Level& at = levels_[static_cast<std::size_t>(k)];
        at.thinned = ThinnedRows(at.width, at.last_x, period_ > 0, samples_->levels_of_nodes());
        if (first_pole_) at.first_cap = polar_cap(k, true);
        if (last_pole_) at.last_cap = polar_cap(k, false);
    }
}

Raster::Halvings Raster::halvings(double columns, int most) {
    if (!(columns > 1) || most == 0) return {};
    if (!(columns < std::ldexp(1.0, most))) return {most, 0};
    int exponent = 0;
    const double mantissa = std::frexp(columns, &exponent);
    return {exponent - 1, smooth_step(2 * mantissa - 1)};
}

double Raster::columns_of(SamplePlace density, double footprint) const {
    const double columns = footprint > 0 ? density.x * footprint : 0; // at a pole columns have no width
    return cylindrical_ ? std::max(columns, columns_for(density.x / density.y)) : columns;
}

double Raster::level_row(int k, double y) const {
    const Level& at = level(k);
    const bool nodes = samples_->levels_of_nodes();
    const double shift = nodes ? 0 : 0.5;
    return warped((y + shift) / at.scale - shift, at.height, at.last_y, last_pole_ ? End::mirror : End::edge,
                  nodes);
}

double Raster::level_column(int k, double x) const {
    const Level& at = level(k);
    const bool nodes = samples_->levels_of_nodes();
    const double shift = nodes ? 0 : 0.5;
    return warped((x + shift) / at.scale - shift, at.width, at.last_x, period_ > 0 ? End::seam : End::edge,
                  nodes);
}

double Raster::thinned_column(int k, double x, std::int64_t count) const {
    const Level& at = level(k);
    const double shift = samples_->levels_of_nodes() ? 0 : 0.5;
    return at.thinned.place((x + shift) / at.scale - shift, count);
}

double Raster::level_turn(int k, double x) const {
    const Level& at = level(k);
    const double shift = samples_->levels_of_nodes() ? 0 : 0.5;
    return at.thinned.turn((x + shift) / at.scale - shift);
}

PolarCap Raster::polar_cap(int k, bool first) const {
    const Level& at = level(k);
    // Rings of the rows nearest to the pole, in columns about a quarter as far apart as rows are.
    std::array<std::vector<float>, PolarCap::max_rows> rings;
    std::vector<float> row(static_cast<std::size_t>(at.width));
    const auto ring_at = [&](std::int64_t stored) -> const std::vector<float>& {
        const std::int64_t from_pole = first ? stored : at.height - 1 - stored;
        std::vector<float>& ring =
            rings[static_cast<std::size_t>(std::min<std::int64_t>(from_pole, PolarCap::max_rows - 1))];
        if (!ring.empty()) return ring;
        const double distance = std::max(static_cast<double>(from_pole), 0.5);
        const auto wanted = static_cast<std::int64_t>(4 * std::ceil(std::numbers::pi * distance));
        for (std::int64_t x = 0; x < at.width; x += 4096) {
            const auto count = static_cast<int>(std::min<std::int64_t>(4096, at.width - x));
            samples_->read(
                k, x, stored, count, 1,
                std::span(row).subspan(static_cast<std::size_t>(x), static_cast<std::size_t>(count)));
        }
        ring.resize(static_cast<std::size_t>(std::min(wanted, at.width)));
        const auto count = static_cast<std::int64_t>(ring.size());
        std::vector<float> means(ring.size() + 2);
        at.thinned.thin(count, 0, row, std::span(means).subspan(1, ring.size()));
        means.front() = means[ring.size()];
        means.back() = means[1];
        at.thinned.sharpen(count, means, ring);
        return ring;
    };
    const auto in_ring = [](const std::vector<float>& ring, double turn) {
        const auto count = static_cast<std::int64_t>(ring.size());
        const double place = turn * static_cast<double>(count) - 0.5, left = std::floor(place);
        const std::array<double, 4> weights = catmull_rom(place - left);
        double sum = 0;
        for (std::int64_t i = 0; i < 4; ++i)
            sum += weights[static_cast<std::size_t>(i)] *
                   static_cast<double>(ring[static_cast<std::size_t>(
                       floor_mod(static_cast<std::int64_t>(left) - 1 + i, count))]);
        return sum;
    };
    const auto mean = [](const std::vector<float>& ring) {
        double sum = 0;
        for (const float v : ring)
            sum += static_cast<double>(v);
        return sum / static_cast<double>(ring.size());
    };
    const double rows = std::min(PolarCap::max_reach, 0.25 * static_cast<double>(at.height));
    return PolarCap(rows, [&](double distance, double turn) {
        const double y = level_row(k, first ? frame_.first_pole_y() + distance * at.scale
                                            : frame_.last_pole_y() - distance * at.scale);
        const double top = std::floor(y);
        const std::array<double, 4> down = catmull_rom(y - top);
        double sum = 0;
        for (std::int64_t j = 0; j < 4; ++j) {
            bool beyond = false;
            const std::vector<float>& ring =
                ring_at(stored_row(k, static_cast<std::int64_t>(top) - 1 + j, beyond));
            sum += down[static_cast<std::size_t>(j)] *
                   (distance == 0 ? mean(ring) : in_ring(ring, beyond ? turn + 0.5 : turn));
        }
        return sum;
    });
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
    const Densities around = densities(centre, radius);
    const SamplePlace density = around.largest;
    // Half of a cubic of the coarser level, and the samples that its outer ones are means of.
    const double across = columns_of({density.x, around.least.y}, footprint);
    const bool thinned = cylindrical_ && across > 1;
    constexpr double beside = PolarCap::max_reach + 3;
    const bool plain = across <= 1 && density.y * footprint <= 1 &&
                       !(first_pole_ && area.least.y < frame_.first_pole_y() + beside) &&
                       !(last_pole_ && area.largest.y > frame_.last_pole_y() - beside);
    SampleRange range;
    if (plain && cubic_range(area, range)) return range;
    const double margin_x = plain ? 3 : std::min((thinned ? 8 : 6) * std::max(1.0, across) + 2, 2 * width);
    const double margin_y = plain ? 3 : std::min(6 * std::max(1.0, density.y * footprint) + 2, 2 * height);
    double x0 = area.least.x - margin_x, x1 = area.largest.x + margin_x;
    double y0 = area.least.y - margin_y, y1 = area.largest.y + margin_y;
    const bool first_cap = first_pole_ && y0 < 0, last_cap = last_pole_ && y1 > height - 1;
    if (area.all) {
        x0 = y0 = 0;
        x1 = width;
        y1 = height;
    }
    if (y1 < 0 || y0 > height - 1 || (period_ == 0 && (x1 < 0 || x0 > width - 1)))
        return {std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity()};
    // Beyond a pole the samples are those of other longitudes.
    if (first_cap || last_cap) {
        x0 = 0;
        x1 = width;
    }
    const auto block = [&](double left, double right, double top, double bottom) {
        const auto index = [](double place, double count) {
            return static_cast<std::int64_t>(std::clamp(place, 0.0, count - 1));
        };
        const std::int64_t x = index(std::floor(left), width), y = index(std::floor(top), height);
        return samples_->range(x, y, index(std::ceil(right), width) - x + 1,
                               index(std::ceil(bottom), height) - y + 1);
    };
    const auto around_both = [](SampleRange a, SampleRange b) {
        return SampleRange{std::min(a.least, b.least), std::max(a.largest, b.largest)};
    };
    const auto exceeded = [&](SampleRange of, double by) {
        if (!(of.least <= of.largest)) return of;
        double most = by * (static_cast<double>(of.largest) - static_cast<double>(of.least));
        // Bezier points are a third of the steps beside a sample away from it at most, or a ninth of those
        // across.
        if (plain) most = std::min(most, 7.0 / 9 * static_cast<double>(of.largest_step));
        const auto over = static_cast<float>(most * (1 + 1e-6));
        return SampleRange{std::nextafter(of.least - over, -std::numeric_limits<float>::infinity()),
                           std::nextafter(of.largest + over, std::numeric_limits<float>::infinity())};
    };
    range = block(x0, x1, y0, y1);
    const auto turn = static_cast<double>(period_);
    if (period_ > 0 && (x0 < 0 || x1 > turn - 1)) {
        const SampleRange other = x1 - x0 >= turn ? block(0, width, y0, y1)
                                  : x0 < 0        ? block(x0 + turn, width, y0, y1)
                                                  : block(0, x1 - turn, y0, y1);
        range = around_both(range, other);
    }
    range = exceeded(range, thinned ? overshoot_of_thinned : raster_overshoot);
    for (const Level& at : levels_) {
        if (first_cap && at.first_cap.exists()) range = around_both(range, at.first_cap.range());
        if (last_cap && at.last_cap.exists()) range = around_both(range, at.last_cap.range());
        if (at.scale > density.y * footprint) break; // coarser ones are not used
    }
    return range;
}

bool Raster::cubic_range(const Area& place, SampleRange& range) const {
    // Rounding of places stays far below.
    constexpr double slack = 1e-3;
    const Area area{{place.least.x - slack, place.least.y - slack},
                    {place.largest.x + slack, place.largest.y + slack}};
    if (place.all || area.largest.x - area.least.x > max_cubic_cells ||
        area.largest.y - area.least.y > max_cubic_cells)
        return false;
    const auto before = [](double at) { return static_cast<std::int64_t>(std::floor(at)) - 1; };
    const std::int64_t left = before(area.least.x), top = before(area.least.y);
    const auto columns = static_cast<int>(before(area.largest.x) - left) + 4;
    const auto rows = static_cast<int>(before(area.largest.y) - top) + 4;
    // Rows beyond the raster's are its outermost, which bounds the part that has values.
    if (period_ == 0 && (left + columns <= 0 || left >= frame_.width())) return false;
    if (top + rows <= 0 || top >= frame_.height()) return false;
    std::array<float, (max_cubic_cells + 5) * (max_cubic_cells + 5)> samples;
    Reader reader(*this);
    for (int j = 0; j < rows; ++j)
        reader.read_row(reader.columns(0, 0), left, top + j, columns,
                        samples.data() + std::ptrdiff_t{j} * columns);
    const std::span<const float> read(samples.data(),
                                      static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows));
    if (std::any_of(read.begin(), read.end(), [](float v) { return std::isnan(v); })) return false;
    const auto x = static_cast<double>(left), y = static_cast<double>(top);
    const CubicBounds bounds = cubic_bounds(
        read, columns, {area.least.x - x, area.largest.x - x, area.least.y - y, area.largest.y - y});
    const double rounding = 1e-12 * std::max(std::abs(bounds.least), std::abs(bounds.largest));
    constexpr float infinity = std::numeric_limits<float>::infinity();
    range = {std::nextafter(static_cast<float>(bounds.least - rounding), -infinity),
             std::nextafter(static_cast<float>(bounds.largest + rounding), infinity)};
    return true;
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

} // namespace obscura::terrain
