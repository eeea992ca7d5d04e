// SPDX-License-Identifier: Apache-2.0
// Absolute instants: TAI nanoseconds, and the barycentric dynamical time (TDB) that ephemerides are given in.
#pragma once

#include <compare>
#include <cstdint>

namespace obscura::ephemeris {

/// Absolute instant: nanoseconds of TAI since 1970-01-01T00:00:00 TAI, the count of a PTP clock. 1678 to
/// 2262.
struct Epoch {
    std::int64_t tai_ns = 0;

    constexpr auto operator<=>(const Epoch&) const = default;
};

/// TDB since J2000 (2000-01-01T12:00:00 TDB), the time argument of SPICE kernels ("ET"), in two parts, so
/// that positions are exact to the nanosecond of time: one double has steps of 60 ns in 2026.
struct TdbTime {
    double whole_s = 0; ///< an integer
    double part_s = 0;  ///< in [0, 1)

    /// Sum in one double.
    [[nodiscard]] constexpr double seconds() const { return whole_s + part_s; }
    /// Later by `span_s`, of any sign; loses nothing for whole spans.
    [[nodiscard]] TdbTime operator+(double span_s) const;
};

/// TDB at an instant on Earth's geoid at the geocentre's longitude: TDB - TT by Fairhead and Bretagnon
/// (1990), Astron. Astrophys. 229, 240, as in ERFA's `eraDtdb`, within some microseconds of the numerically
/// integrated one.
[[nodiscard]] TdbTime to_tdb(Epoch epoch);
/// Inverse of to_tdb(), rounded to the nanosecond.
[[nodiscard]] Epoch to_epoch(TdbTime tdb);

} // namespace obscura::ephemeris
