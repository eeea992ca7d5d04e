// SPDX-License-Identifier: Apache-2.0
// Logarithms of the distances of samples, by which procedural detail fades in between them.
#pragma once

#include "terrain/detail/exact_math.hpp"

#include <cmath>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

namespace obscura::terrain {

/// Logarithm of a distance of samples, m: infinite for an infinite one (no samples), minus infinite for one
/// that is not positive.
[[nodiscard]] inline double log2_spacing(double sample_spacing_m) {
    constexpr double infinity = std::numeric_limits<double>::infinity();
    if (!std::isfinite(sample_spacing_m)) return infinity;
    return sample_spacing_m > 0 ? exact_log2(sample_spacing_m) : -infinity;
}

[[nodiscard]] inline std::vector<double> log2_spacings(std::span<const double> sample_spacings_m) {
    std::vector<double> result;
    result.reserve(sample_spacings_m.size());
    double last = -1;
    for (const double spacing : sample_spacings_m) { // often the same
        result.push_back(spacing == last ? result.back() : log2_spacing(spacing));
        last = spacing;
    }
    return result;
}

/// Adds to `lost` the squared slopes of octaves of detail, each times the square of its share,
/// `share(octave, log2_spacing)`.
template<typename Share>
void add_shared_slopes(std::span<const double> squared_slopes, std::span<const double> sample_spacings_m,
                       std::span<double> lost, const Share& share) {
    double last = -1, sum = 0;
    for (std::size_t n = 0; n < lost.size(); ++n) {
        if (sample_spacings_m[n] != last) { // often the same
            last = sample_spacings_m[n];
            const double spacing = log2_spacing(last);
            sum = 0;
            for (std::size_t k = 0; k < squared_slopes.size(); ++k) {
                const double part = share(k, spacing);
                sum += part * part * squared_slopes[k];
            }
        }
        lost[n] += sum;
    }
}

} // namespace obscura::terrain
