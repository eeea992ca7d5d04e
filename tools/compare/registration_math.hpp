// SPDX-License-Identifier: Apache-2.0
// Sums, interpolation and smoothing that shift and pointing fits share.
#pragma once

#include "images/image.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace obscura::tools {

/// Sums of a linear regression of y on x.
struct RegressionSums {
    std::int64_t n = 0;
    double a = 0, b = 0, aa = 0, bb = 0, ab = 0;

    void add(double x, double y) {
        ++n;
        a += x, b += y, aa += x * x, bb += y * y, ab += x * y;
    }
    [[nodiscard]] double correlation() const {
        if (n < 2) return -1;
        const auto count = static_cast<double>(n);
        const double va = aa - a * a / count, vb = bb - b * b / count;
        // The correlation with a flat image is undefined; return the lowest, so that it is never chosen.
        if (!(va > 1e-14 * aa) || !(vb > 1e-14 * bb)) return -1;
        return (ab - a * b / count) / std::sqrt(va * vb);
    }
};

/// Over the pixels that both images have.
[[nodiscard]] RegressionSums sums_of(const images::Image& a, const images::Image& b);

/// Difference of two images, each normalised to mean 0 and variance 1 over the pixels that both have; NaN
/// elsewhere.
[[nodiscard]] images::Image normalised_difference(const images::Image& a, const images::Image& b);

/// Contribution of each block of a grid over two images to their correlation.
constexpr std::int32_t grid_blocks = 8;
using BlockShares = std::array<double, static_cast<std::size_t>(grid_blocks* grid_blocks)>;
/// The correlation is 1 - mean(difference^2) / 2 of the normalised difference; a contribution is the part
/// that a block subtracts.
[[nodiscard]] BlockShares block_shares(const images::Image& difference);
[[nodiscard]] double total(const BlockShares& shares);

/// Weights of Keys' cubic convolution (a = -1/2) for the four neighbours of a point `t` past the second.
inline std::array<double, 4> cubic_weights(double t) {
    const double t2 = t * t, t3 = t2 * t;
    return {-0.5 * t + t2 - 0.5 * t3, 1 - 2.5 * t2 + 1.5 * t3, 0.5 * t + 2 * t2 - 1.5 * t3,
            -0.5 * t2 + 0.5 * t3};
}

/// Whether a parameter of a fit ends at the limit of its search: on it, or just before it with a higher
/// correlation beyond. `correlation_at`: of the parameter, the others as fitted. False if the limit is 0.
template<class Correlation>
[[nodiscard]] bool ends_at_limit(double value, double limit, const Correlation& correlation_at) {
    constexpr double rounding = 1e-9, near = 0.1;
    const double inside = limit - std::abs(value);
    if (!(limit > 0) || inside > near) return false;
    return inside <= rounding || correlation_at(std::copysign(limit + near, value)) > correlation_at(value);
}

/// Image smoothed by a Gaussian of one pixel; NaN pixels are left out. Interpolation smooths noise by an
/// amount that depends on the shift, and smoother images correlate better: without this filter shifts are
/// biased towards odd multiples of half a pixel by a tenth of a pixel or more.
[[nodiscard]] images::Image smoothed(const images::Image& image);

} // namespace obscura::tools
