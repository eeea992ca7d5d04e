// SPDX-License-Identifier: Apache-2.0
// Exponential, logarithm, power and arc cosine in plain arithmetic: they vectorise, and give the same bits
// everywhere.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace obscura {

/// The operations beside + - * / of which the templates below are made, for numbers; a type of numbers side
/// by side brings its own.
inline double select(bool when, double a, double b) {
    return when ? a : b;
}
inline bool is_number(double x) {
    return x == x; // NOLINT(misc-redundant-expression): false for NaN
}
inline double square_root(double x) {
    return __builtin_sqrt(x);
}
/// 2^n of the n that `shifted` holds in its low bits, n + 1.5 * 2^52.
inline double power_of_two(double shifted) {
    return std::bit_cast<double>((std::bit_cast<std::uint64_t>(shifted) + 1023) << 52);
}
/// x = mantissa 2^exponent, mantissa in [sqrt 1/2, sqrt 2), for normal positive x.
inline void split(double x, double& mantissa, double& exponent) {
    constexpr std::uint64_t sqrt_half = 0x3fe6a09e667f3bcd;
    const std::uint64_t u = std::bit_cast<std::uint64_t>(x) + (0x3ff0000000000000 - sqrt_half);
    mantissa = std::bit_cast<double>((u & 0x000fffffffffffff) + sqrt_half);
    // The biased exponent as a double: its bits under those of 2^52.
    exponent = std::bit_cast<double>((u >> 52) | 0x4330000000000000) - (0x1p52 + 1023);
}

/// e^x within 3 ulp for -700 < x < 700; outside, the value at the nearer end.
template<typename Number>
inline Number vector_exp(Number x) {
    constexpr double to_integer = 0x1.8p52; // adding it leaves the nearest integer in the low bits
    x = select(x < -700.0, Number(-700), x);
    x = select(x > 700.0, Number(700), x);
    const Number shifted = x * 1.4426950408889634 + to_integer;
    const Number n = shifted - to_integer;
    // ln 2 in two parts, so that n ln 2 is exact to far below an ulp of the remainder.
    const Number r = (x - n * 0x1.62e42feep-1) - n * 0x1.a39ef35793c76p-33;
    Number p = 1.0 / 6227020800.0;
    constexpr std::array<double, 13> inverse_factorials{
        1.0 / 479001600, 1.0 / 39916800, 1.0 / 3628800, 1.0 / 362880, 1.0 / 40320, 1.0 / 5040, 1.0 / 720,
        1.0 / 120,       1.0 / 24,       1.0 / 6,       1.0 / 2,      1.0,         1.0};
    for (const double c : inverse_factorials)
        p = p * r + c;
    return p * power_of_two(shifted);
}

/// ln x within 3 ulp for normal positive x.
template<typename Number>
inline Number vector_log(Number x) {
    Number m = x, k = x;
    split(x, m, k);
    const Number f = (m - 1.0) / (m + 1.0);
    const Number s = f * f;
    Number p = 1.0 / 21;
    for (const double c : std::array<double, 9>{1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13, 1.0 / 11, 1.0 / 9,
                                                1.0 / 7, 1.0 / 5, 1.0 / 3})
        p = p * s + c;
    return k * 0.6931471805599453 + (f * 2.0 + f * 2.0 * s * p);
}

/// x^y for x > 0.
inline double vector_pow(double x, double y) {
    return vector_exp(y * vector_log(x));
}

/// e^x, relative error 5e-10, for -700 < x < 700; outside, the value at the nearer end. Sufficient for
/// empirical BRDFs.
inline double quick_exp(double x) {
    constexpr double to_integer = 0x1.8p52;
    x = x < -700 ? -700 : x;
    x = x > 700 ? 700 : x;
    const double shifted = x * 1.4426950408889634 + to_integer;
    const double r = x - (shifted - to_integer) * 0.6931471805599453;
    double p = 1.0 / 40320;
    for (const double c :
         std::array<double, 8>{1.0 / 5040, 1.0 / 720, 1.0 / 120, 1.0 / 24, 1.0 / 6, 1.0 / 2, 1.0, 1.0})
        p = p * r + c;
    return p * power_of_two(shifted);
}

/// ln(1 + 1/x) within 2e-11 of itself for 1e-300 < x < 10.
inline double quick_log_1_plus_inverse(double x) {
    double m = 1, k = 0;
    split((1 + x) / x, m, k);
    const double f = (m - 1) / (m + 1);
    const double s = f * f;
    double p = 1.0 / 13;
    for (const double c : std::array<double, 5>{1.0 / 11, 1.0 / 9, 1.0 / 7, 1.0 / 5, 1.0 / 3})
        p = p * s + c;
    return k * 0.6931471805599453 + (2 * f + 2 * f * s * p);
}

/// Arc cosine of -1 <= x <= 1 within 8e-11 rad: sqrt(1 - |x|) times a Chebyshev fit of degree 10.
inline double quick_acos(double x) {
    const double a = x < 0 ? -x : x;
    double p = 0.00023782898206263782;
    for (const double c : std::array<double, 10>{
             -0.0015934182517230511, 0.005045559097779914, -0.010418507955037057, 0.016689436282340462,
             -0.023774520196620866, 0.033564007757248646, -0.05077912334981534, 0.08904778999125114,
             -0.21460181664073863, 1.5707963267151568})
        p = p * a + c;
    const double acos_a = __builtin_sqrt(1 - a) * p;
    return x < 0 ? 3.141592653589793 - acos_a : acos_a;
}

/// The first terms of (arc sine z) / z as a polynomial in z^2, for |z| <= 1/2.
template<int Terms, typename Number>
[[gnu::always_inline]] inline Number arc_sine_series(Number z2) {
    constexpr std::array<double, Terms> series = [] {
        std::array<double, Terms> c{};
        double binomial = 1; // (2n)! / (4^n n!^2)
        for (int n = 0; n < Terms; ++n) {
            c[static_cast<std::size_t>(Terms - 1 - n)] = binomial / (2 * n + 1);
            binomial *= (2.0 * n + 1) / (2.0 * n + 2);
        }
        return c;
    }();
    Number p = 0.0;
    for (const double c : series)
        p = p * z2 + c;
    return p;
}

/// Arc cosine within 1e-13 rad, x clamped to [-1, 1].
template<typename Number>
inline Number vector_acos(Number x) {
    x = select(x < -1.0, Number(-1), x);
    x = select(x > 1.0, Number(1), x);
    const auto negative = x < 0.0;
    const Number a = select(negative, -x, x);
    const auto outer = a > 0.5;
    // asin z = z sum c_n z^2n on |z| <= 1/2; beyond, acos x = 2 asin sqrt((1-x)/2).
    const Number z2 = select(outer, (Number(1) - a) / 2.0, a * a);
    const Number z = square_root(z2); // of a square this is a itself
    const Number asin_z = z * arc_sine_series<22>(z2);
    constexpr double pi = 3.141592653589793;
    const Number acos_a = select(outer, asin_z * 2.0, Number(pi / 2) - asin_z);
    return select(negative, Number(pi) - acos_a, acos_a);
}

} // namespace obscura
