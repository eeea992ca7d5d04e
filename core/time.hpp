// SPDX-License-Identifier: Apache-2.0
// Instants and spans of time: int64 nanoseconds in one scheduling clock.
#pragma once

#include <compare>
#include <cstdint>

namespace obscura {

/// An instant, in nanoseconds of the scheduling clock (CLOCK_MONOTONIC unless a test runs under a FakeClock).
/// Spans are plain `std::int64_t` whose names end in `_ns`. The offset to TAI is carried beside an instant
/// and applied only at the edge (GVSP time stamps, logs, ephemerides), see Clock::tai_offset_ns().
struct Time {
    std::int64_t ns = 0;

    constexpr auto operator<=>(const Time&) const = default;
    constexpr Time& operator+=(std::int64_t span_ns) {
        ns += span_ns;
        return *this;
    }
};

constexpr Time operator+(Time t, std::int64_t span_ns) {
    return {t.ns + span_ns};
}
constexpr Time operator-(Time t, std::int64_t span_ns) {
    return {t.ns - span_ns};
}
constexpr std::int64_t operator-(Time a, Time b) {
    return a.ns - b.ns;
}
/// The instant half way between two others; no overflow for any pair of the same sign.
constexpr Time midpoint(Time a, Time b) {
    return {a.ns + (b.ns - a.ns) / 2};
}

constexpr std::int64_t ns_per_us = 1'000;
constexpr std::int64_t ns_per_ms = 1'000'000;
constexpr std::int64_t ns_per_s = 1'000'000'000;

constexpr double to_seconds(std::int64_t span_ns) {
    return static_cast<double>(span_ns) * 1e-9;
}

} // namespace obscura
