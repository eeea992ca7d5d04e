// SPDX-License-Identifier: Apache-2.0
#include "models/graph/interval.hpp"

#include "models/graph/graph.hpp"

#include <array>
#include <numbers>

namespace obscura::models {
namespace {

constexpr double pi = std::numbers::pi;
constexpr double infinity = std::numeric_limits<double>::infinity();
/// Relative error of arithmetic, and of functions, beyond which bounds are moved.
constexpr double arithmetic_rounding = 0x1p-52, function_rounding = 0x1p-42;

/// 0 stays: it is exact, or a positive number that has no bits left.
double lowered_by(double x, double rounding) {
    return std::isfinite(x) && x != 0 ? x - std::abs(x) * rounding - std::numeric_limits<double>::denorm_min()
                                      : x;
}
double raised_by(double x, double rounding) {
    return std::isfinite(x) && x != 0 ? x + std::abs(x) * rounding + std::numeric_limits<double>::denorm_min()
                                      : x;
}

/// Bounds that were computed with a relative error of `rounding`.
Interval rounded(double lo, double hi, double rounding = arithmetic_rounding) {
    if (!(lo <= hi)) return Interval::whole();
    return {lowered_by(lo, rounding), raised_by(hi, rounding)};
}

double end_product(double a, double b) {
    return a == 0 || b == 0 ? 0 : a * b;
}

double value_of(Operation operation, double x) {
    return result_of(operation, x, 0, 0);
}
/// The values of a function that rises.
Interval rising(Operation operation, Interval a) {
    return rounded(value_of(operation, a.lo), value_of(operation, a.hi), function_rounding);
}

/// Whether a has x + 2 pi k for some whole k.
bool has_angle(Interval a, double x) {
    return std::floor((a.hi - x) / (2 * pi) + 1e-9) >= std::ceil((a.lo - x) / (2 * pi) - 1e-9);
}

Interval interval_of_sine(Interval a) {
    if (!a.is_finite() || a.magnitude() > 1e6) return {-1, 1};
    const double from = value_of(Operation::sine, a.lo), to = value_of(Operation::sine, a.hi);
    const double margin = function_rounding * (1 + a.magnitude());
    const double lo = has_angle(a, -pi / 2) ? -1 : std::max(-1.0, std::min(from, to) - margin);
    const double hi = has_angle(a, pi / 2) ? 1 : std::min(1.0, std::max(from, to) + margin);
    return {lo, hi};
}

Interval interval_of_tangent(Interval a) {
    if (!a.is_finite() || a.hi - a.lo >= pi || has_angle(a, pi / 2) || has_angle(a, -pi / 2))
        return Interval::whole();
    return rising(Operation::tangent, a);
}

Interval interval_of_angle(Interval y, Interval x) {
    const bool cut = x.lo <= 0 && y.has(0);
    if (cut || !x.is_finite() || !y.is_finite()) return {-pi - 1e-15, pi + 1e-15};
    const std::array<double, 4> corners{std::atan2(y.lo, x.lo), std::atan2(y.lo, x.hi),
                                        std::atan2(y.hi, x.lo), std::atan2(y.hi, x.hi)};
    const auto [least, most] = std::minmax_element(corners.begin(), corners.end());
    return {*least - function_rounding, *most + function_rounding};
}

Interval interval_of_power(Interval a, Interval b) {
    if (b.is_one_number() && b.lo == std::floor(b.lo) && std::abs(b.lo) < 1e6) {
        const Interval power = whole_power(a, b.lo);
        return rounded(power.lo, power.hi, 1e3 * function_rounding); // e^(b ln a) is not exact
    }
    if (a.lo < 0) return Interval::whole();
    std::array<double, 4> ends{};
    std::size_t count = 0;
    for (const double x : {a.lo, a.hi})
        for (const double y : {b.lo, b.hi})
            ends[count++] = result_of(Operation::power, x, y, 0);
    const auto [least, most] = std::minmax_element(ends.begin(), ends.end());
    if (std::any_of(ends.begin(), ends.end(), [](double x) { return std::isnan(x); }))
        return Interval::whole();
    // Powers of 1, and of the exponent 0, are 1 whatever the ends.
    return rounded(std::min(*least, a.has(1) || b.has(0) ? 1 : *least),
                   std::max(*most, a.has(1) || b.has(0) ? 1 : *most), 1e3 * function_rounding);
}

/// C's fmod.
Interval interval_of_remainder(Interval a, Interval b) {
    const Interval quotient = a / b;
    if (quotient.is_finite() && std::trunc(quotient.lo) == std::trunc(quotient.hi))
        return a - Interval::at(std::trunc(quotient.lo)) * b;
    const double most = std::min(b.magnitude(), a.magnitude());
    return {a.lo < 0 ? -most : 0, a.hi > 0 ? most : 0};
}

Interval condition(bool always, bool never) {
    return {always ? 1.0 : 0.0, never ? 0.0 : 1.0};
}

Interval interval_of_function(Operation operation, Interval a) {
    switch (operation) {
    case Operation::absolute:
        if (a.lo >= 0) return a;
        return a.hi <= 0 ? -a : Interval{0, a.magnitude()};
    case Operation::square_root:
        if (a.hi < 0) return Interval::whole();
        return {std::max(0.0, lowered_by(std::sqrt(std::max(0.0, a.lo)), arithmetic_rounding)),
                raised_by(std::sqrt(a.hi), arithmetic_rounding)};
    case Operation::round_down:
        return {std::floor(a.lo), std::floor(a.hi)};
    case Operation::exponential:
        return rising(operation, a);
    case Operation::logarithm:
        if (a.lo < 0) return Interval::whole();
        return {lowered_by(value_of(operation, a.lo), function_rounding) - function_rounding,
                raised_by(value_of(operation, a.hi), function_rounding) + function_rounding};
    case Operation::sine:
        return interval_of_sine(a);
    case Operation::cosine:
        return interval_of_sine(a + Interval{pi / 2 - 1e-15, pi / 2 + 1e-15});
    case Operation::tangent:
        return interval_of_tangent(a);
    case Operation::arc_sine:
        return rising(operation, common({-1, 1}, a));
    case Operation::arc_cosine: {
        const Interval inside = common({-1, 1}, a);
        return rounded(value_of(operation, inside.hi) - function_rounding,
                       value_of(operation, inside.lo) + function_rounding);
    }
    case Operation::arc_tangent:
        return rising(operation, a);
    default:
        return Interval::whole();
    }
}

} // namespace

Interval hull(Interval a, Interval b) noexcept {
    return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)};
}

Interval common(Interval a, Interval b) noexcept {
    const Interval both{std::max(a.lo, b.lo), std::min(a.hi, b.hi)};
    return both.lo <= both.hi ? both : a;
}

Interval operator+(Interval a, Interval b) noexcept {
    return rounded(a.lo + b.lo, a.hi + b.hi);
}

Interval operator-(Interval a, Interval b) noexcept {
    return rounded(a.lo - b.hi, a.hi - b.lo);
}

Interval operator-(Interval a) noexcept {
    return {-a.hi, -a.lo};
}

Interval operator*(Interval a, Interval b) noexcept {
    if (a.is_zero() || b.is_zero()) return {0, 0};
    const double p = end_product(a.lo, b.lo), q = end_product(a.lo, b.hi), r = end_product(a.hi, b.lo),
                 s = end_product(a.hi, b.hi);
    return rounded(std::min(std::min(p, q), std::min(r, s)), std::max(std::max(p, q), std::max(r, s)));
}

Interval operator/(Interval a, Interval b) noexcept {
    if (a.is_zero()) return {0, 0};
    if (b.lo > 0 || b.hi < 0) return a * rounded(1 / b.hi, 1 / b.lo);
    if (b.lo == 0 && b.hi > 0) // a bound on one side at least
        return {a.lo >= 0 ? std::max(0.0, lowered_by(a.lo / b.hi, arithmetic_rounding)) : -infinity,
                a.hi <= 0 ? std::min(0.0, raised_by(a.hi / b.hi, arithmetic_rounding)) : infinity};
    return Interval::whole();
}

Interval square(Interval a) noexcept {
    const double least = a.has(0) ? 0 : std::min(a.lo * a.lo, a.hi * a.hi), most = a.magnitude();
    return {std::max(0.0, lowered_by(least, arithmetic_rounding)),
            raised_by(most * most, arithmetic_rounding)};
}

Interval whole_power(Interval a, double n) noexcept {
    if (n == 0) return {1, 1};
    if (n < 0) return Interval::at(1) / whole_power(a, -n);
    if (n == 1) return a;
    if (n == 2) return square(a);
    const double low = std::pow(a.lo, n), high = std::pow(a.hi, n);
    if (std::fmod(n, 2) != 0) return rounded(low, high, 1e3 * function_rounding);
    return rounded(a.has(0) ? 0 : std::min(low, high), std::max(low, high), 1e3 * function_rounding);
}

Interval interval_of(Operation operation, Interval a, Interval b, Interval c) noexcept {
    switch (operation) {
    case Operation::add:
        return a + b;
    case Operation::subtract:
        return a - b;
    case Operation::multiply:
        return a * b;
    case Operation::divide:
        return a / b;
    case Operation::minimum:
        return {std::min(a.lo, b.lo), std::min(a.hi, b.hi)};
    case Operation::maximum:
        return {std::max(a.lo, b.lo), std::max(a.hi, b.hi)};
    case Operation::power:
        return interval_of_power(a, b);
    case Operation::remainder:
        return interval_of_remainder(a, b);
    case Operation::arc_tangent_2:
        return interval_of_angle(a, b);
    case Operation::less:
        return condition(a.hi < b.lo, a.lo >= b.hi);
    case Operation::less_or_equal:
        return condition(a.hi <= b.lo, a.lo > b.hi);
    case Operation::equal:
        return condition(a.is_one_number() && b.is_one_number() && a.lo == b.lo, a.hi < b.lo || b.hi < a.lo);
    case Operation::both:
        return condition(!a.has(0) && !b.has(0), a.is_zero() || b.is_zero());
    case Operation::either:
        return condition(!a.has(0) || !b.has(0), a.is_zero() && b.is_zero());
    case Operation::negate:
        return -a;
    case Operation::invert:
        return condition(a.is_zero(), !a.has(0));
    case Operation::select:
        if (!a.has(0)) return b;
        return a.is_zero() ? c : hull(b, c);
    default:
        return interval_of_function(operation, a);
    }
}

} // namespace obscura::models
