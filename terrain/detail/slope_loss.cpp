// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/slope_loss.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace obscura::terrain {
namespace {

/// At so small a distance features are taken for smooth.
constexpr double smooth = 0x1p-5;
constexpr int table_size = 6;

} // namespace

double kept_squared_slope(const std::function<double(double)>& structure, double cell) {
    // Slopes at two vertices, from differences over two cells each, have the covariance
    // [D(|d + 2 c|) + D(|d - 2 c|) - 2 D(|d|)] / 8 c^2, where d is the way from one to the other. In the mean
    // over a cell, linear interpolation weighs a vertex with itself by 1/9, with a neighbour by 1/18, across
    // by 1/36.
    const auto d = [&](double squared_cells) { return structure(cell * std::sqrt(squared_cells)); };
    const double one = d(1), two = d(2);
    const double same = 2 * d(4);
    const double ahead = d(9) + one - 2 * one, beside = 2 * d(5) - 2 * one;
    const double across = d(10) + two - 2 * two;
    return (4 * same + 2 * ahead + 2 * beside + across) / 9 / (8 * cell * cell);
}

SlopeLoss::SlopeLoss(const std::function<double(double)>& structure, double cell)
    : whole_(structure(smooth) / (smooth * smooth)) {
    int exponent = 0;
    const double mantissa = std::frexp(cell, &exponent);
    for (int n = 0; n < table_size; ++n) {
        const double kept = kept_squared_slope(structure, std::ldexp(mantissa, -n));
        lost_.push_back(whole_ > 0 ? std::clamp(1 - kept / whole_, 0.0, 1.0) : 0.0);
    }
}

double SlopeLoss::share(double ratio) const {
    int exponent = 0;
    std::frexp(ratio, &exponent);
    if (exponent > 0) return 1;
    const auto n = static_cast<std::size_t>(-exponent);
    if (n < lost_.size()) return lost_[n];
    // Where cells are small, the loss goes as their area.
    return std::ldexp(lost_.back(), -2 * static_cast<int>(n - lost_.size() + 1));
}

} // namespace obscura::terrain
