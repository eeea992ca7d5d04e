// SPDX-License-Identifier: Apache-2.0
// Sine, cosine, tangent and their inverses in plain arithmetic: they vectorise, and give the same bits
// everywhere.
#pragma once

#include <array>
#include <bit>
#include <cstdint>

namespace obscura {

/// Sine and cosine of x within 2e-16 + 1e-16 |x| for |x| < 1e6; NaN from 1e9 on, where a double has too few
/// digits of an angle left.
inline void vector_sincos(double x, double& sine, double& cosine) {
    constexpr double to_integer = 0x1.8p52; // adding it leaves the nearest integer in the low bits
    const double shifted = x * 0.6366197723675814 + to_integer;
    const double n = shifted - to_integer;
    const auto quarter = std::bit_cast<std::uint64_t>(shifted);
    // pi/2 in three parts of 33 bits, so that n times each of the first two is exact.
    double r = x - n * 0x1.921fb544p+0;
    r = r - n * 0x1.0b4611a6p-34;
    r = r - n * 0x1.3198a2e037073p-69;
    const double r2 = r * r;
    // Taylor polynomials on |r| <= pi/4: the next terms are below 1e-19.
    double s = 0, c = 0;
    for (const double k :
         std::array<double, 8>{1.0 / 355687428096000, -1.0 / 1307674368000, 1.0 / 6227020800, -1.0 / 39916800,
                               1.0 / 362880, -1.0 / 5040, 1.0 / 120, -1.0 / 6})
        s = s * r2 + k;
    s = r + r * (r2 * s);
    for (const double k : std::array<double, 8>{1.0 / 20922789888000, -1.0 / 87178291200, 1.0 / 479001600,
                                                -1.0 / 3628800, 1.0 / 40320, -1.0 / 720, 1.0 / 24, -0.5})
        c = c * r2 + k;
    c = 1 + r2 * c;
    const bool swap = (quarter & 1) != 0;
    const double a = swap ? c : s;
    const double b = swap ? s : c;
    const double sine_sign = (quarter & 2) != 0 ? -1.0 : 1.0;
    const double cosine_sign = ((quarter + 1) & 2) != 0 ? -1.0 : 1.0;
    // Written so that a NaN stays one.
    const bool small = x < 1e9 && x > -1e9;
    const double none = __builtin_nan("");
    sine = small ? sine_sign * a : none;
    cosine = small ? cosine_sign * b : none;
}

/// Arc sine within 2e-16, x clamped to [-1, 1].
inline double vector_asin(double x) {
    x = x < -1 ? -1 : x;
    x = x > 1 ? 1 : x;
    const double a = x < 0 ? -x : x;
    const bool outer = a > 0.5;
    // asin z = z sum c_n z^2n on |z| <= 1/2; beyond, asin x = pi/2 - 2 asin sqrt((1-x)/2).
    const double z2 = outer ? (1 - a) / 2 : a * a;
    const double z = outer ? __builtin_sqrt(z2) : a;
    constexpr std::array<double, 25> series = [] {
        std::array<double, 25> c{};
        double binomial = 1; // (2n)! / (4^n n!^2)
        for (int n = 0; n < 25; ++n) {
            c[static_cast<std::size_t>(24 - n)] = binomial / (2 * n + 1);
            binomial *= (2.0 * n + 1) / (2.0 * n + 2);
        }
        return c;
    }();
    double p = 0;
    for (const double c : series)
        p = p * z2 + c;
    const double asin_z = z * p;
    const double asin_a = outer ? 1.5707963267948966 - 2 * asin_z : asin_z;
    return x < 0 ? -asin_a : asin_a;
}

/// Arc tangent within 3e-16 of itself.
inline double vector_atan(double x) {
    const double a = x < 0 ? -x : x;
    constexpr double tan_pi_8 = 0.41421356237309503, cot_pi_8 = 2.414213562373095;
    // atan a = pi/2 + atan(-1/a), or pi/4 + atan((a-1)/(a+1)).
    const bool large = a > cot_pi_8;
    const bool middle = a > tan_pi_8 && !large;
    const double numerator = large ? -1.0 : middle ? a - 1 : a;
    const double denominator = large ? a : middle ? a + 1 : 1.0;
    const double z = numerator / denominator;
    const double z2 = z * z;
    // sum (-1)^n z^2n / (2n+1): the next term is below 2e-17 at tan(pi/8).
    double p = 0;
    for (int n = 20; n >= 1; --n)
        p = p * z2 + ((n & 1) != 0 ? -1.0 : 1.0) / (2 * n + 1);
    const double atan_z = z + z * (z2 * p);
    const double base = large ? 1.5707963267948966 : middle ? 0.7853981633974483 : 0.0;
    const double atan_a = base + atan_z;
    return x < 0 ? -atan_a : atan_a;
}

/// Angle of (x, y) in (-pi, pi]; 0 at the origin.
inline double vector_atan2(double y, double x) {
    const double ax = x < 0 ? -x : x;
    const double ay = y < 0 ? -y : y;
    const bool steep = ay > ax;
    const double top = steep ? ax : ay;
    const double bottom = steep ? ay : ax;
    // The ratio is 1 for equal infinities, 0 at the origin.
    const double ratio = bottom == 0 ? 0.0 : top == bottom ? 1.0 : top / bottom;
    const double z = vector_atan(ratio);
    const double first = steep ? 1.5707963267948966 - z : z;
    const double half = x < 0 ? 3.141592653589793 - first : first;
    const double angle = y < 0 ? -half : half;
    return x != x || y != y ? __builtin_nan("") : angle; // NaN
}

} // namespace obscura
