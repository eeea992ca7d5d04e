// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/thinned_rows.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::terrain {
namespace {

/// Fewest columns of a full turn, and of a row with ends.
constexpr double min_turn = 8, min_row = 1;

} // namespace

ThinnedRows::ThinnedRows(std::int64_t columns, double last, bool cyclic, bool nodes)
    : columns_(columns), width_(static_cast<double>(columns) - 1 + (nodes && !cyclic ? 1 : last)) {
    // Between the last node and the first one, both reach half of the way.
    if (nodes && cyclic) {
        middle_ = 0.5 * last;
        before_ = 0.5 - middle_;
    }
    counts_ = {columns};
    const double least = cyclic ? min_turn : min_row;
    for (double wide = 0.5 * width_; wide >= least; wide *= 0.5)
        counts_.push_back(static_cast<std::int64_t>(cyclic ? 2 * std::ceil(0.5 * wide) : std::ceil(wide)));
}

std::int64_t ThinnedRows::sample_at(double place) const {
    return std::clamp<std::int64_t>(static_cast<std::int64_t>(std::floor(place + before_)), 0, columns_ - 1);
}

ThinnedRows::Span ThinnedRows::source(std::int64_t count, std::int64_t first, std::int64_t wanted) const {
    const double wide = width_ / static_cast<double>(count);
    const std::int64_t left = sample_at(static_cast<double>(first) * wide);
    return {left, sample_at(static_cast<double>(first + wanted) * wide) - left + 1};
}

void ThinnedRows::thin(std::int64_t count, std::int64_t first, std::span<const float> samples,
                       std::span<float> out) const {
    const double wide = width_ / static_cast<double>(count);
    const std::int64_t left = source(count, first, static_cast<std::int64_t>(out.size())).first;
    for (std::size_t i = 0; i < out.size(); ++i) {
        const double begin = static_cast<double>(first + static_cast<std::int64_t>(i)) * wide;
        const double end = begin + wide;
        double sum = 0, weights = 0;
        for (std::int64_t j = sample_at(begin), last = sample_at(end); j <= last; ++j) {
            const float v = samples[static_cast<std::size_t>(j - left)];
            const double weight = std::min(end, begin_of(j + 1)) - std::max(begin, begin_of(j));
            if (std::isnan(v) || !(weight > 0)) continue;
            sum += weight * static_cast<double>(v);
            weights += weight;
        }
        out[i] = weights > 0 ? static_cast<float>(sum / weights) : std::numeric_limits<float>::quiet_NaN();
    }
}

void ThinnedRows::sharpen(std::int64_t count, std::span<const float> means, std::span<float> out) const {
    const double narrower = static_cast<double>(count) / width_;
    const double share = std::max(0.0, (1 - narrower * narrower) / 24);
    for (std::size_t i = 0; i < out.size(); ++i) {
        const auto mean = [&](std::size_t k) { return static_cast<double>(means[i + k]); };
        const double bend = mean(0) - 2 * mean(1) + mean(2);
        out[i] = std::isnan(bend) ? means[i + 1] : static_cast<float>(mean(1) - share * bend);
    }
}

} // namespace obscura::terrain
