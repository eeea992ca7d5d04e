// SPDX-License-Identifier: Apache-2.0
// Cubic convolution kernel of Catmull and Rom, plain and stretched, and indices that wrap.
#pragma once

#include <array>
#include <cmath>
#include <cstdint>

namespace obscura::terrain {

/// Weights of four samples at -1, 0, 1, 2 for the place `t`, 0 to 1 (Keys, Cubic convolution interpolation
/// for digital image processing, IEEE ASSP 29, 1981).
[[nodiscard]] inline std::array<double, 4> catmull_rom(double t) {
    const double t2 = t * t, t3 = t2 * t;
    return {-0.5 * t3 + t2 - 0.5 * t, 1.5 * t3 - 2.5 * t2 + 1, -1.5 * t3 + 2 * t2 + 0.5 * t,
            0.5 * t3 - 0.5 * t2};
}

/// The same as one function of the distance.
[[nodiscard]] inline double cubic(double distance) {
    const double t = std::abs(distance);
    if (t >= 2) return 0;
    return t < 1 ? (1.5 * t - 2.5) * t * t + 1 : ((-0.5 * t + 2.5) * t - 4) * t + 2;
}

[[nodiscard]] constexpr std::int64_t floor_mod(std::int64_t value, std::int64_t divisor) {
    const std::int64_t r = value % divisor;
    return r < 0 ? r + divisor : r;
}

} // namespace obscura::terrain
