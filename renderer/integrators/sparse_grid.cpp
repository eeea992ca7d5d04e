// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/sparse_grid.hpp"

#include "core/philox.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/packets/sampler.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::renderer {
namespace {

// Variance of an interpolated pixel over the squared second difference of the points about it, a mean over
// the places between two points, for three kinds of light, told by how much the squared differences grow when
// the distance doubles.

/// Noise of the points, which does not grow: interpolated in both directions it has 4/9 of a point's
/// variance, and second differences have 6 times as much.
constexpr double of_noise = 4.0 / 9 / 6;
constexpr double noise_growth = 1.2;
/// An edge doubles them. Interpolation makes a ramp of it, as the pixel's response does: 1/12 where that is
/// narrow, least where both are as wide. By the response's standard deviation over the distance of the
/// points, 0, 0.1, ... 1.
constexpr std::array of_edge{0.0833, 0.0598, 0.0448, 0.0365, 0.0335, 0.0343,
                             0.0377, 0.0430, 0.0497, 0.0573, 0.0657};
constexpr double edge_growth = 2;
/// Curved light makes them grow by 16; 1/120 along an axis, here with independent curvatures along both.
constexpr double of_curve = 1.0 / 60;
constexpr double curve_growth = 16;

/// How much an edge counts in its direction: 1 overestimates those that run across the axes, 0 halves those
/// along them.
constexpr double of_directed = 0.6;

/// Points on either side over which the growth is measured.
constexpr std::int32_t window = 12;

/// Share of `growth` on the way from `from` to `to`, by powers.
double way(double growth, double from, double to) {
    return std::log(std::clamp(growth, from, to) / from) / std::log(to / from);
}

/// How much of the light is edges.
double edge_share(double growth) {
    return growth < edge_growth ? way(growth, noise_growth, edge_growth)
                                : 1 - way(growth, edge_growth, curve_growth);
}

/// From one kind to the next by the powers of the growth. `response`: over the distance of the points.
double interpolated(double growth, double response) {
    const double at = std::clamp(response, 0.0, 1.0) * (of_edge.size() - 1);
    const std::size_t k = std::min(static_cast<std::size_t>(at), of_edge.size() - 2);
    const double edge = std::lerp(of_edge[k], of_edge[k + 1], at - static_cast<double>(k));
    const auto between = [growth](double first, double from, double second, double to) {
        return first * std::pow(second / first, way(growth, from, to));
    };
    return growth < edge_growth ? between(of_noise, noise_growth, edge, edge_growth)
                                : between(edge, edge_growth, of_curve, curve_growth);
}

} // namespace

void SparseGrid::reset(std::int32_t step, std::int32_t x, std::int32_t width, std::int32_t y,
                       std::int32_t height, std::size_t channels, double response_px, std::uint64_t seed,
                       std::uint64_t frame_id) {
    step_ = step;
    response_ = response_px / step;
    const SeedWords random = seed_words(seed, frame_id, SamplePurpose::sample_grid, step, 0);
    shift_x_ = uniform_double(random[0]) * step;
    shift_y_ = uniform_double(random[1]) * step;
    const auto multiple_below = [](std::int32_t v, std::int32_t of) { return v - ((v % of) + of) % of; };
    // Whole packets, the same for any window.
    first_x_ = multiple_below(x - step, packet_size * step);
    first_y_ = multiple_below(y, step) - 2 * step;
    const std::int32_t points = (x + width - first_x_ + step - 1) / step + 2;
    columns_ = (points + packet_size - 1) / packet_size * packet_size;
    rows_ = (y + height - first_y_ + step - 1) / step + 2;
    values_.assign(channels * plane(), 0.0F);
    variance_.assign(plane(), 0.0F);
    filled_.assign(static_cast<std::size_t>(rows_), 0);
    estimated_.assign(static_cast<std::size_t>(rows_), 0);
}

SparseGrid::Between SparseGrid::between(std::int32_t pixel, std::int32_t first, double shift) const {
    const std::int32_t steps = (pixel - first) / step_;
    const double at = (pixel - first - steps * step_ - shift) / step_; // the same for any window
    return at < 0 ? Between{steps - 1, at + 1} : Between{steps, at};
}

void SparseGrid::interpolate(std::size_t c, std::int32_t x, std::int32_t y, std::span<double> out) const {
    const auto [r, down] = between(y, first_y_, shift_y_);
    const float* const above =
        values_.data() + c * plane() + static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_);
    const float* const below = above + columns_;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const auto [k, right] = between(x + static_cast<std::int32_t>(i), first_x_, shift_x_);
        const double upper =
            (1 - right) * static_cast<double>(above[k]) + right * static_cast<double>(above[k + 1]);
        const double lower =
            (1 - right) * static_cast<double>(below[k]) + right * static_cast<double>(below[k + 1]);
        out[i] = (1 - down) * upper + down * lower;
    }
}

double SparseGrid::point(std::size_t channels, std::int32_t column, std::int32_t row) const {
    double sum = 0;
    for (std::size_t c = 0; c < channels; ++c)
        sum += static_cast<double>(
            values_[c * plane() + static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) +
                    static_cast<std::size_t>(column)]);
    return sum / static_cast<double>(channels);
}

void SparseGrid::estimate(std::int32_t r, std::size_t channels) {
    // Squares of the second differences of points `apart` columns, 0 at the ends.
    const auto squared = [&](std::int32_t column, std::int32_t apart) {
        if (column < apart || column >= columns_ - apart) return 0.0;
        const double d = point(channels, column - apart, r) - 2 * point(channels, column, r) +
                         point(channels, column + apart, r);
        return d * d;
    };
    // The same across the row, of the rows next to it.
    const auto squared_across = [&](std::int32_t column) {
        if (column < 0 || column >= columns_) return 0.0;
        const double d =
            point(channels, column, r - 1) - 2 * point(channels, column, r) + point(channels, column, r + 1);
        return d * d;
    };
    double near = 0, far = 0, across = 0; // sums over the window
    const auto add = [&](std::int32_t column, double sign) {
        near += sign * squared(column, 1);
        far += sign * squared(column, 2);
        across += sign * squared_across(column);
    };
    estimated_[static_cast<std::size_t>(r)] = 1;
    // Only the lit points, and one on either side, have differences.
    const auto lit = [&](std::int32_t column) {
        return point(channels, column, r - 1) > 0 || point(channels, column, r) > 0 ||
               point(channels, column, r + 1) > 0;
    };
    std::int32_t begin = 0;
    std::int32_t end = columns_;
    while (begin < end && !lit(begin))
        ++begin;
    while (begin < end && !lit(end - 1))
        --end;
    if (begin == end) return;
    begin = std::max(0, begin - 1);
    end = std::min(columns_, end + 1);
    for (std::int32_t k = begin - window; k < begin + window; ++k)
        add(k, 1);
    float* const out = variance_.data() + static_cast<std::size_t>(r) * static_cast<std::size_t>(columns_);
    for (std::int32_t k = begin; k < end; ++k) {
        add(k + window, 1);
        if (const double along = squared(k, 1), over = squared_across(k); along + over > 0) {
            // Growth is measured along rows. What there is more of across them are edges along rows, such as
            // those at the upper and lower ends of a body.
            const double along_growth = near > 0 ? far / near : edge_growth;
            const double edges = std::max(0.0, across - near), sum = near + across;
            const double growth =
                sum > 0 ? (along_growth * (sum - edges) + edge_growth * edges) / sum : edge_growth;
            // Noise and curves have as much along rows as across, an edge in the direction that it has.
            const double mean = (along + over) / 2;
            const double own = std::lerp(mean, std::max(along, over), of_directed * edge_share(growth));
            out[k] = static_cast<float>(interpolated(growth, response_) * own);
        }
        add(k - window, -1);
    }
}

void SparseGrid::variance(std::int32_t x, std::int32_t y, std::span<double> out) const {
    const float* const above =
        variance_.data() + static_cast<std::size_t>(row_about(y)) * static_cast<std::size_t>(columns_);
    const float* const below = above + columns_;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const std::int32_t k = between(x + static_cast<std::int32_t>(i), first_x_, shift_x_).first;
        out[i] = (static_cast<double>(above[k]) + static_cast<double>(above[k + 1]) +
                  static_cast<double>(below[k]) + static_cast<double>(below[k + 1])) /
                 4;
    }
}

} // namespace obscura::renderer
