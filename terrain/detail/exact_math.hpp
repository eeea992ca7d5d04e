// SPDX-License-Identifier: Apache-2.0
// Logarithms, powers, sines and tangents from IEEE operations alone: the same bits on every machine.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

// The C library's functions are good to about one unit of the last place, and pick other code on CPUs that
// have fused multiply-add; terrain made from them would differ between machines.
namespace obscura::terrain {

/// x > 0 and finite. Good to 1e-15.
[[nodiscard]] inline double exact_log2(double x) {
    int exponent = 0;
    double mantissa = std::frexp(x, &exponent);
    if (mantissa < 0.70710678118654752) {
        mantissa *= 2;
        --exponent;
    }
    // ln m = 2 artanh t with |t| < 0.172.
    const double t = (mantissa - 1) / (mantissa + 1), square = t * t;
    constexpr std::array<double, 12> terms{1.0 / 23, 1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13,
                                           1.0 / 11, 1.0 / 9,  1.0 / 7,  1.0 / 5,  1.0 / 3,  1.0};
    double sum = 0;
    for (const double term : terms)
        sum = sum * square + term;
    return exponent + 2 * t * sum * std::numbers::log2e;
}

/// 2 to the power x, |x| < 1000. Good to 1e-15 of the result.
[[nodiscard]] inline double exact_exp2(double x) {
    const double whole = std::floor(x + 0.5);
    const double y = (x - whole) * std::numbers::ln2;
    double sum = 1;
    for (int n = 17; n >= 1; --n)
        sum = 1 + sum * y / n;
    return std::ldexp(sum, static_cast<int>(whole));
}

/// x to the power y, x > 0.
[[nodiscard]] inline double exact_pow(double x, double y) {
    return exact_exp2(y * exact_log2(x));
}

[[nodiscard]] inline double exact_exp(double x) {
    return exact_exp2(x * std::numbers::log2e);
}

/// |x| <= pi / 2 - 1e-3.
[[nodiscard]] inline double exact_tan(double x) {
    double sine = 0, cosine = 0;
    for (int n = 24; n >= 0; n -= 2) {
        cosine = 1 - cosine * x * x / ((n + 1) * (n + 2));
        sine = 1 - sine * x * x / ((n + 2) * (n + 3));
    }
    return x * sine / cosine;
}

/// 1 / (n (n + 1)), from n = 1 at 1.
inline constexpr std::array<double, 19> reciprocals_of_pairs = [] {
    std::array<double, 19> result{};
    for (std::size_t n = 1; n < result.size(); ++n)
        result[n] = 1.0 / static_cast<double>(n * (n + 1));
    return result;
}();

struct CosineSine {
    double cosine = 1, sine = 0;
};
/// Cosine and sine of an angle in turns, |turns| < 1e6. Good to 1e-15.
[[nodiscard]] inline CosineSine exact_cosine_sine(double turns) {
    const double quarters = std::floor(4 * turns + 0.5);
    const double x = 2 * std::numbers::pi * (turns - 0.25 * quarters), square = x * x;
    double sine = 1, cosine = 1;
    for (std::size_t k = 9; k >= 1; --k) {
        cosine = 1 - cosine * square * reciprocals_of_pairs[2 * k - 1];
        sine = 1 - sine * square * reciprocals_of_pairs[2 * k];
    }
    sine *= x;
    switch (static_cast<int>(quarters - 4 * std::floor(0.25 * quarters))) {
    case 0:
        return {cosine, sine};
    case 1:
        return {-sine, cosine};
    case 2:
        return {-cosine, -sine};
    default:
        return {sine, -cosine};
    }
}

/// Angle of (x, y) in turns, 0 to 1; 0 at the origin. Good to 1e-15.
[[nodiscard]] inline double exact_turn(double x, double y) {
    const double longer = std::fmax(std::fabs(x), std::fabs(y));
    const double shorter = std::fmin(std::fabs(x), std::fabs(y));
    if (longer == 0) return 0;
    // Twice half the angle, whose tangent is below 0.2.
    double t = shorter / longer;
    for (int k = 0; k < 2; ++k)
        t = t / (1 + std::sqrt(1 + t * t));
    double sum = 0;
    for (int n = 23; n >= 1; n -= 2)
        sum = 1.0 / n - sum * t * t;
    const double eighth = 4 * t * sum / (2 * std::numbers::pi);
    const double quarter = std::fabs(y) > std::fabs(x) ? 0.25 - eighth : eighth;
    const double half = x < 0 ? 0.5 - quarter : quarter;
    return y < 0 ? 1 - half : half;
}

/// 0 below 0, 1 above 1, with continuous slope between.
[[nodiscard]] constexpr double smooth_step(double x) {
    if (x <= 0) return 0;
    if (x >= 1) return 1;
    return x * x * (3 - 2 * x);
}

} // namespace obscura::terrain
