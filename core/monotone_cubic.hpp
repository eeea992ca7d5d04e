// SPDX-License-Identifier: Apache-2.0
// Monotone cubic interpolation of a table.
#pragma once

#include <algorithm>
#include <cstddef>
#include <vector>

namespace obscura {

/// Slopes at the entries of a monotone cubic through (x, y): 0 where y turns. x increases; at least two
/// entries. Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5(2), 1984.
[[nodiscard]] inline std::vector<double> monotone_slopes(const std::vector<double>& x,
                                                         const std::vector<double>& y) {
    const std::size_t n = x.size();
    std::vector<double> chord(n - 1);
    for (std::size_t i = 0; i + 1 < n; ++i)
        chord[i] = (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    std::vector<double> slope(n);
    slope[0] = chord[0];
    slope[n - 1] = chord[n - 2];
    for (std::size_t i = 1; i + 1 < n; ++i) {
        const double a = (1 + (x[i + 1] - x[i]) / (x[i + 1] - x[i - 1])) / 3;
        const double product = chord[i - 1] * chord[i];
        slope[i] = product > 0 ? product / (a * chord[i] + (1 - a) * chord[i - 1]) : 0.0;
    }
    return slope;
}

/// Value at `at`, within the range of x, of the cubic with those slopes.
[[nodiscard]] inline double monotone_cubic(const std::vector<double>& x, const std::vector<double>& y,
                                           const std::vector<double>& slopes, double at) {
    const auto after = std::upper_bound(x.begin() + 1, x.end() - 1, at);
    const auto i = static_cast<std::size_t>(after - x.begin()) - 1;
    const double width = x[i + 1] - x[i];
    const double t = (at - x[i]) / width;
    return y[i] * (1 + 2 * t) * (1 - t) * (1 - t) + slopes[i] * width * t * (1 - t) * (1 - t) +
           y[i + 1] * t * t * (3 - 2 * t) + slopes[i + 1] * width * t * t * (t - 1);
}

} // namespace obscura
