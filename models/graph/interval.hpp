// SPDX-License-Identifier: Apache-2.0
// Interval arithmetic for the operations of a graph: bounds that hold for all values of the operands.
#pragma once

#include "models/graph/operation.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::models {

/// All numbers from `lo` to `hi`; rounded outwards. What may be no number at all is the whole line.
struct Interval {
    double lo = 0, hi = 0;

    [[nodiscard]] static constexpr Interval whole() noexcept {
        constexpr double infinity = std::numeric_limits<double>::infinity();
        return {-infinity, infinity};
    }
    [[nodiscard]] static constexpr Interval at(double x) noexcept { return {x, x}; }

    [[nodiscard]] bool is_zero() const noexcept { return lo == 0 && hi == 0; }
    [[nodiscard]] bool is_one_number() const noexcept { return lo == hi; }
    [[nodiscard]] bool has(double x) const noexcept { return lo <= x && x <= hi; }
    [[nodiscard]] bool is_finite() const noexcept { return std::isfinite(lo) && std::isfinite(hi); }
    /// Largest absolute value.
    [[nodiscard]] double magnitude() const noexcept { return std::max(std::abs(lo), std::abs(hi)); }
};

/// The smallest interval that has both.
[[nodiscard]] Interval hull(Interval a, Interval b) noexcept;
/// What both have; `a` where they have nothing in common.
[[nodiscard]] Interval common(Interval a, Interval b) noexcept;

[[nodiscard]] Interval operator+(Interval a, Interval b) noexcept;
[[nodiscard]] Interval operator-(Interval a, Interval b) noexcept;
[[nodiscard]] Interval operator-(Interval a) noexcept;
/// 0 times anything is 0.
[[nodiscard]] Interval operator*(Interval a, Interval b) noexcept;
/// The whole line where `b` has 0.
[[nodiscard]] Interval operator/(Interval a, Interval b) noexcept;
[[nodiscard]] Interval square(Interval a) noexcept;
/// x^n for a whole number n of either sign.
[[nodiscard]] Interval whole_power(Interval a, double n) noexcept;

/// The values that `operation` can have; a condition has 0, 1 or both.
[[nodiscard]] Interval interval_of(Operation operation, Interval a, Interval b, Interval c) noexcept;

} // namespace obscura::models
