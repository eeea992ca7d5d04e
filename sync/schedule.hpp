// SPDX-License-Identifier: Apache-2.0
// Periodic schedule: instants computed from their number, so that no error accumulates.
#pragma once

#include "core/time.hpp"

#include <cstdint>

namespace obscura::sync {

/// A frequency as a fraction of two positive integers, in Hz.
struct RationalRate {
    std::int64_t numerator = 1, denominator = 1;

    constexpr bool operator==(const RationalRate&) const = default;
    [[nodiscard]] constexpr double hz() const {
        return static_cast<double>(numerator) / static_cast<double>(denominator);
    }
};

inline constexpr double lowest_rate_hz = 1e-6, highest_rate_hz = 1e6;

/// The simplest fraction that equals `hz` within 1e-9 of its value: 10 -> 10/1, 29.97 -> 2997/100,
/// 29.97002997 -> 30000/1001. Both terms stay below 2^30. Throws std::invalid_argument unless `hz`
/// is from lowest_rate_hz to highest_rate_hz.
[[nodiscard]] RationalRate rational_rate(double hz);

/// Slot k lies at start + phase + k/rate, rounded down to the nanosecond: off by less than 1 ns for every k,
/// however large. Immutable and cheap to copy.
class Schedule {
public:
    Schedule(RationalRate rate, Time start, std::int64_t phase_ns);

    [[nodiscard]] Time slot(std::uint64_t k) const noexcept;
    /// Number of the first slot at or after `t`.
    [[nodiscard]] std::uint64_t first_slot_from(Time t) const noexcept;
    [[nodiscard]] double period_ns() const noexcept;
    [[nodiscard]] RationalRate rate() const noexcept { return rate_; }

private:
    RationalRate rate_;
    Time first_;
};

} // namespace obscura::sync
