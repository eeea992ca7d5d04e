// SPDX-License-Identifier: Apache-2.0
// Leap second tables: TAI - UTC by day, from the system, a file or ERFA.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace obscura::ephemeris {

/// Step of TAI - UTC at the beginning of a UTC day.
struct LeapSecond {
    std::int64_t day = 0; ///< first UTC day with this value, days since 1970-01-01
    std::int32_t tai_minus_utc_s = 0;

    constexpr bool operator==(const LeapSecond&) const = default;
};

/// TAI - UTC from 1972 on. Days before the first entry follow ERFA's table, in which UTC has a rate of its
/// own from 1960 to 1971.
struct LeapSeconds {
    std::vector<LeapSecond> steps; ///< at least one; days increase, values change by one
    std::string source;            ///< file, or "ERFA"
    /// Instant up to which the source is known to be complete, s since 1970 without leap seconds.
    std::optional<std::int64_t> expires_utc_s{};
};

/// A UTC day: beginning and length.
struct UtcDay {
    std::int64_t tai_ns = 0; ///< its 0 h, ns of TAI since 1970
    /// In UTC seconds: 86400 s, 86401 s with a leap second, 86399 s with a negative one.
    std::int64_t length_ns = 0;
    double tai_per_utc_less_1 = 0; ///< excess of the TAI second rate; 0 from 1972 on
};

/// The UTC day `day`, days since 1970-01-01. Throws ConfigError before 1960, when there was no UTC.
[[nodiscard]] UtcDay utc_day(std::int64_t day, const LeapSeconds& leap_seconds);

/// First day of UTC, 1960-01-01, days since 1970-01-01.
inline constexpr std::int64_t first_utc_day = -3653;

/// Reads an IERS list (leap-seconds.list) or a leap second kernel (LSK), told apart by their content. Throws
/// ConfigError `file:line: what`.
[[nodiscard]] LeapSeconds read_leap_seconds(const std::filesystem::path& file);
/// As read_leap_seconds(), from the content of a file; `name` is for messages.
[[nodiscard]] LeapSeconds parse_leap_seconds(const std::string& text, const std::string& name);
/// Throws ConfigError `name: what` unless there are steps, their days increase and values change by one.
void validate(const LeapSeconds& leap_seconds, const std::string& name);

/// The table of the ERFA library.
[[nodiscard]] LeapSeconds erfa_leap_seconds();
/// The list of the system's time zone data, or ERFA's table where it has none that can be read or ERFA's has
/// more steps.
[[nodiscard]] LeapSeconds system_leap_seconds();
/// The list of Debian's tzdata.
inline constexpr const char* system_leap_second_file = "/usr/share/zoneinfo/leap-seconds.list";

} // namespace obscura::ephemeris
