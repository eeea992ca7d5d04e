// SPDX-License-Identifier: Apache-2.0
// Logarithms of the distances of samples, by which procedural detail fades in between them.
#pragma once

#include "terrain/detail/exact_math.hpp"

#include <cmath>
#include <limits>
#include <span>
#include <vector>

namespace obscura::terrain {

/// Of a distance of samples, m: infinite for an infinite one (no samples), minus infinite for one that is not
/// positive.
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

} // namespace obscura::terrain
