// SPDX-License-Identifier: Apache-2.0
#include "sync/schedule.hpp"

#include <algorithm>
#include <cmath>
#include <stdexcept>

namespace obscura::sync {

RationalRate rational_rate(double hz) {
    if (!(hz >= lowest_rate_hz && hz <= highest_rate_hz))
        throw std::invalid_argument("a rate must lie between 1e-6 and 1e6 Hz");
    // Compute the convergents of the continued fraction: best rational approximations in rising order of
    // their terms.
    constexpr std::int64_t limit = std::int64_t{1} << 30;
    std::int64_t p0 = 1, q0 = 0;
    auto p1 = static_cast<std::int64_t>(std::floor(hz));
    std::int64_t q1 = 1;
    double rest = hz - std::floor(hz);
    while (p1 == 0 || std::abs(static_cast<double>(p1) / static_cast<double>(q1) - hz) > 1e-9 * hz) {
        if (rest <= 0) break;
        const double inverse = 1 / rest;
        const double digit = std::floor(inverse);
        if (digit >= static_cast<double>(limit)) break;
        const auto a = static_cast<std::int64_t>(digit);
        const std::int64_t p2 = a * p1 + p0;
        const std::int64_t q2 = a * q1 + q0;
        if (p2 >= limit || q2 >= limit) break;
        p0 = p1, q0 = q1, p1 = p2, q1 = q2;
        rest = inverse - digit;
    }
    return {p1, q1};
}

Schedule::Schedule(RationalRate rate, Time start, std::int64_t phase_ns)
    : rate_(rate), first_(start + phase_ns) {}

Time Schedule::slot(std::uint64_t k) const noexcept {
    // k * (1e9 * d) / n without 128-bit numbers: with k = a n + b and 1e9 d = q n + r, it is
    // a (1e9 d) + b q + b r / n, and b r < n^2 < 2^60.
    const auto n = static_cast<std::uint64_t>(rate_.numerator);
    const std::uint64_t span = static_cast<std::uint64_t>(rate_.denominator) * ns_per_s;
    const std::uint64_t a = k / n, b = k % n;
    const std::uint64_t q = span / n, r = span % n;
    return first_ + static_cast<std::int64_t>(a * span + b * q + b * r / n);
}

std::uint64_t Schedule::first_slot_from(Time t) const noexcept {
    if (t <= first_) return 0;
    // Correct the floating-point estimate, which is off by a few slots at most, by the exact slots.
    auto k = static_cast<std::uint64_t>(static_cast<double>(t - first_) / period_ns());
    while (k > 0 && slot(k - 1) >= t)
        --k;
    while (slot(k) < t)
        ++k;
    return k;
}

double Schedule::period_ns() const noexcept {
    return 1e9 / rate_.hz();
}

} // namespace obscura::sync
