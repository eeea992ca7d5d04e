// SPDX-License-Identifier: Apache-2.0
// Sine, cosine, tangent and their inverses in plain arithmetic: they vectorise, and give the same bits
// everywhere.
#pragma once

#include "core/math/vector_functions.hpp"

#include <array>
#include <bit>
#include <cstdint>

namespace obscura {

/// Whether the low bits of `shifted`, n + 1.5 * 2^52, plus `more` have `bit`.
inline bool has_bit(double shifted, std::uint64_t more, std::uint64_t bit) {
    return ((std::bit_cast<std::uint64_t>(shifted) + more) & bit) != 0;
}

/// Sine and cosine of x within 2e-16 + 1e-16 |x| for |x| < 1e6; NaN from 1e9 on, where a double has too few
/// digits of an angle left.
template<typename Number>
inline void vector_sincos(Number x, Number& sine, Number& cosine) {
    constexpr double to_integer = 0x1.8p52; // adding it leaves the nearest integer in the low bits
    const Number shifted = x * 0.6366197723675814 + to_integer;
    const Number n = shifted - to_integer;
    // pi/2 in three parts of 33 bits, so that n times each of the first two is exact.
    Number r = x - n * 0x1.921fb544p+0;
    r = r - n * 0x1.0b4611a6p-34;
    r = r - n * 0x1.3198a2e037073p-69;
    const Number r2 = r * r;
    // Taylor polynomials on |r| <= pi/4: the next terms are below 1e-19.
    Number s = 0.0, c = 0.0;
    for (const double k :
         std::array<double, 8>{1.0 / 355687428096000, -1.0 / 1307674368000, 1.0 / 6227020800, -1.0 / 39916800,
                               1.0 / 362880, -1.0 / 5040, 1.0 / 120, -1.0 / 6})
        s = s * r2 + k;
    s = r + r * (r2 * s);
    for (const double k : std::array<double, 8>{1.0 / 20922789888000, -1.0 / 87178291200, 1.0 / 479001600,
                                                -1.0 / 3628800, 1.0 / 40320, -1.0 / 720, 1.0 / 24, -0.5})
        c = c * r2 + k;
    c = r2 * c + 1.0;
    const auto swap = has_bit(shifted, 0, 1);
    const Number a = select(swap, c, s);
    const Number b = select(swap, s, c);
    const Number signed_a = select(has_bit(shifted, 0, 2), -a, a);
    const Number signed_b = select(has_bit(shifted, 1, 2), -b, b);
    // Written so that a NaN stays one.
    const Number none = __builtin_nan("");
    sine = select(x < 1e9, select(x > -1e9, signed_a, none), none);
    cosine = select(x < 1e9, select(x > -1e9, signed_b, none), none);
}

/// Arc sine within 2e-16, x clamped to [-1, 1].
template<typename Number>
inline Number vector_asin(Number x) {
    x = select(x < -1.0, Number(-1), x);
    x = select(x > 1.0, Number(1), x);
    const auto negative = x < 0.0;
    const Number a = select(negative, -x, x);
    const auto outer = a > 0.5;
    // asin z = z sum c_n z^2n on |z| <= 1/2; beyond, asin x = pi/2 - 2 asin sqrt((1-x)/2).
    const Number z2 = select(outer, (Number(1) - a) / 2.0, a * a);
    const Number z = select(outer, square_root(z2), a);
    const Number asin_z = z * arc_sine_series<25>(z2);
    const Number asin_a = select(outer, Number(1.5707963267948966) - asin_z * 2.0, asin_z);
    return select(negative, -asin_a, asin_a);
}

/// Arc tangent within 3e-16 of itself.
template<typename Number>
inline Number vector_atan(Number x) {
    const auto negative = x < 0.0;
    const Number a = select(negative, -x, x);
    constexpr double tan_pi_8 = 0.41421356237309503, cot_pi_8 = 2.414213562373095;
    // atan a = pi/2 + atan(-1/a), or pi/4 + atan((a-1)/(a+1)).
    const auto large = a > cot_pi_8;
    const auto middle = a > tan_pi_8;
    const Number z = select(large, Number(-1), select(middle, a - 1.0, a)) /
                     select(large, a, select(middle, a + 1.0, Number(1)));
    const Number z2 = z * z;
    // sum (-1)^n z^2n / (2n+1): the next term is below 2e-17 at tan(pi/8).
    constexpr std::array<double, 20> series = [] {
        std::array<double, 20> c{};
        for (int n = 20; n >= 1; --n)
            c[static_cast<std::size_t>(20 - n)] = ((n & 1) != 0 ? -1.0 : 1.0) / (2 * n + 1);
        return c;
    }();
    Number p = 0.0;
    for (const double c : series)
        p = p * z2 + c;
    const Number atan_z = z + z * (z2 * p);
    const Number base =
        select(large, Number(1.5707963267948966), select(middle, Number(0.7853981633974483), Number(0)));
    const Number atan_a = base + atan_z;
    return select(negative, -atan_a, atan_a);
}

/// Angle of (x, y) in (-pi, pi]; 0 at the origin.
template<typename Number>
inline Number vector_atan2(Number y, Number x) {
    const Number ax = select(x < 0.0, -x, x);
    const Number ay = select(y < 0.0, -y, y);
    const auto steep = ay > ax;
    const Number top = select(steep, ax, ay);
    const Number bottom = select(steep, ay, ax);
    // The ratio is 1 for equal infinities, 0 at the origin.
    const Number quotient = select(top == bottom, Number(1), top / bottom);
    const Number ratio = select(bottom == 0.0, Number(0), quotient);
    const Number z = vector_atan(ratio);
    const Number first = select(steep, Number(1.5707963267948966) - z, z);
    const Number half = select(x < 0.0, Number(3.141592653589793) - first, first);
    const Number angle = select(y < 0.0, -half, half);
    const Number none = __builtin_nan("");
    return select(is_number(x), select(is_number(y), angle, none), none);
}

} // namespace obscura
