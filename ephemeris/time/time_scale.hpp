// SPDX-License-Identifier: Apache-2.0
// Time scales UTC, TAI, TT, TDB and GPS: readings of an instant as day and time of day.
#pragma once

#include "core/text/enum_names.hpp"
#include "ephemeris/time/epoch.hpp"
#include "ephemeris/time/leap_seconds.hpp"

#include <array>
#include <cstdint>

namespace obscura::ephemeris {

/// Time scale of a reading.
enum class TimeScale : std::uint8_t {
    utc,
    tai,
    tt,  ///< TAI + 32.184 s
    tdb, ///< of ephemerides, see to_tdb()
    gps, ///< TAI - 19 s
};
constexpr auto enum_names(TimeScale /*type*/) {
    return std::array{EnumName{TimeScale::utc, "UTC"}, EnumName{TimeScale::tai, "TAI"},
                      EnumName{TimeScale::tt, "TT"}, EnumName{TimeScale::tdb, "TDB"},
                      EnumName{TimeScale::gps, "GPS"}};
}

/// Day and time of day that a clock of some scale shows.
struct DayTime {
    std::int64_t day = 0; ///< days since 1970-01-01 of the scale
    std::int64_t ns = 0;  ///< of the day, from 0; beyond 86400 s within a leap second of UTC

    constexpr auto operator<=>(const DayTime&) const = default;
};

/// Reading of `scale` at `epoch`, to the nanosecond. Throws ConfigError for UTC before 1960.
[[nodiscard]] DayTime reading(Epoch epoch, TimeScale scale, const LeapSeconds& leap_seconds);
/// Inverse of reading(). The day must be within first_day .. last_day, and `ns` within the day. Throws
/// ConfigError for UTC before 1960.
[[nodiscard]] Epoch epoch_of(const DayTime& reading, TimeScale scale, const LeapSeconds& leap_seconds);
/// Whether leap seconds at an instant may be missing from the list: it is past the list's expiry.
[[nodiscard]] bool is_past_expiry(Epoch epoch, const LeapSeconds& leap_seconds);
/// Length of a day of `scale`: 86400 s but for UTC.
[[nodiscard]] std::int64_t day_length_ns(std::int64_t day, TimeScale scale, const LeapSeconds& leap_seconds);

/// Days that an Epoch can hold in every scale: 1678-01-01 to 2261-12-31, days since 1970-01-01.
inline constexpr std::int64_t first_day = -106'650, last_day = 106'650;

} // namespace obscura::ephemeris
