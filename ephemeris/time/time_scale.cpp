// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/time/time_scale.hpp"

#include "ephemeris/time/calendar.hpp"

#include <cmath>

namespace obscura::ephemeris {
namespace {

DayTime from_count(std::int64_t ns) {
    DayTime split{ns / ns_per_day, ns % ns_per_day};
    if (split.ns < 0) {
        split.ns += ns_per_day;
        --split.day;
    }
    return split;
}

/// A scale that is TAI plus a constant, ns.
std::int64_t offset_from_tai_ns(TimeScale scale) {
    switch (scale) {
    case TimeScale::tt:
        return 32'184'000'000;
    case TimeScale::gps:
        return -19 * ns_per_s;
    default:
        return 0;
    }
}

DayTime utc_reading(Epoch epoch, const LeapSeconds& leap_seconds) {
    // TAI - UTC is small: the day by TAI is the right one or the one after it.
    std::int64_t day = from_count(epoch.tai_ns).day;
    UtcDay found = utc_day(day, leap_seconds);
    if (epoch.tai_ns < found.tai_ns) found = utc_day(--day, leap_seconds);
    const auto since = static_cast<double>(epoch.tai_ns - found.tai_ns);
    const std::int64_t excess_ns =
        found.tai_per_utc_less_1 == 0
            ? 0
            : std::llround(since * found.tai_per_utc_less_1 / (1 + found.tai_per_utc_less_1));
    return {day, epoch.tai_ns - found.tai_ns - excess_ns};
}

} // namespace

DayTime reading(Epoch epoch, TimeScale scale, const LeapSeconds& leap_seconds) {
    if (scale == TimeScale::utc) return utc_reading(epoch, leap_seconds);
    if (scale != TimeScale::tdb) return from_count(epoch.tai_ns + offset_from_tai_ns(scale));
    const TdbTime tdb = to_tdb(epoch);
    return from_count((static_cast<std::int64_t>(tdb.whole_s) + j2000_s) * ns_per_s +
                      std::llround(tdb.part_s * 1e9));
}

Epoch epoch_of(const DayTime& reading, TimeScale scale, const LeapSeconds& leap_seconds) {
    if (scale == TimeScale::utc) {
        const UtcDay day = utc_day(reading.day, leap_seconds);
        return {day.tai_ns + reading.ns +
                std::llround(static_cast<double>(reading.ns) * day.tai_per_utc_less_1)};
    }
    const std::int64_t count_ns = reading.day * ns_per_day + reading.ns;
    if (scale != TimeScale::tdb) return {count_ns - offset_from_tai_ns(scale)};
    const DayTime seconds{count_ns / ns_per_s, count_ns % ns_per_s};
    return to_epoch(TdbTime{static_cast<double>(seconds.day - j2000_s), 0} +
                    static_cast<double>(seconds.ns) * 1e-9);
}

bool is_past_expiry(Epoch epoch, const LeapSeconds& leap_seconds) {
    const auto& expires_s = leap_seconds.expires_utc_s;
    constexpr std::int64_t day_s = 86'400;
    return expires_s && epoch >= epoch_of({*expires_s / day_s, *expires_s % day_s * ns_per_s}, TimeScale::utc,
                                          leap_seconds);
}

std::int64_t day_length_ns(std::int64_t day, TimeScale scale, const LeapSeconds& leap_seconds) {
    return scale == TimeScale::utc ? utc_day(day, leap_seconds).length_ns : ns_per_day;
}

} // namespace obscura::ephemeris
