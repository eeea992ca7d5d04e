// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/sparse_grid.hpp"

#include "core/philox.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/packets/sampler.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Variance of an interpolated pixel over the square of the second difference of the points about it. With
/// differences between points that grow with the root of their distance, as those of images with edges do,
/// linear interpolation errs by 1/12 of it along an axis (its mean over the places between two points);
/// independent points would give 0.28, smooth ones 1/120 (measured by quality_levels_test.cpp).
constexpr double interpolated = 0.07;

} // namespace

void SparseGrid::reset(std::int32_t step, std::int32_t x, std::int32_t width, std::int32_t y,
                       std::int32_t height, std::size_t channels, std::uint64_t seed,
                       std::uint64_t frame_id) {
    step_ = step;
    const SeedWords random = seed_words(seed, frame_id, SamplePurpose::sample_grid, step, 0);
    shift_x_ = uniform_double(random[0]) * step;
    shift_y_ = uniform_double(random[1]) * step;
    const auto multiple_below = [](std::int32_t v, std::int32_t of) { return v - ((v % of) + of) % of; };
    // Whole packets, the same for any window.
    first_x_ = multiple_below(x - step, packet_size * step);
    first_y_ = multiple_below(y, step) - step;
    const std::int32_t points = (x + width - first_x_ + step - 1) / step + 2;
    columns_ = (points + packet_size - 1) / packet_size * packet_size;
    rows_ = (y + height - first_y_ + step - 1) / step + 2;
    values_.assign(channels * plane(), 0.0F);
    filled_.assign(static_cast<std::size_t>(rows_), 0);
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

void SparseGrid::variance(std::size_t channels, std::int32_t x, std::int32_t y, std::span<double> out) const {
    const std::int32_t r = row_about(y);
    // Along the rows that the pixels are interpolated from, since no other row need be there.
    const auto squared = [&](std::int32_t column) {
        double sum = 0;
        for (const std::int32_t row : {r, r + 1}) {
            const double d = point(channels, column - 1, row) - 2 * point(channels, column, row) +
                             point(channels, column + 1, row);
            sum += d * d;
        }
        return sum / 2;
    };
    std::int32_t last = -1;
    double here = 0;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const std::int32_t k = between(x + static_cast<std::int32_t>(i), first_x_, shift_x_).first;
        if (k != last) {
            const std::int32_t left = std::clamp(k, 1, columns_ - 2);
            const std::int32_t right = std::clamp(k + 1, 1, columns_ - 2);
            here = interpolated * (squared(left) + squared(right)) / 2;
            last = k;
        }
        out[i] = here;
    }
}

} // namespace obscura::renderer
