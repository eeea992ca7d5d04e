// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/time/calendar.hpp"
#include "ephemeris/time/time_text.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace obscura::ephemeris {
namespace {

__extension__ using Wide = __int128;

constexpr std::int64_t jd_of_1970_noon = 2'440'588;

std::int64_t power_of_ten(int exponent) {
    std::int64_t power = 1;
    for (int i = 0; i < exponent; ++i)
        power *= 10;
    return power;
}

/// "12:00:00.5"; `ns` may be within a leap second.
std::string time_of_day(std::int64_t ns, int decimals) {
    const std::int64_t minute = std::min<std::int64_t>(ns / (60 * ns_per_s), 24 * 60 - 1);
    const std::int64_t second_ns = ns - minute * 60 * ns_per_s;
    const std::string second = seconds_text(second_ns, decimals);
    return fmt::format("{:02}:{:02}:{}{}", minute / 60, minute % 60, second_ns < 10 * ns_per_s ? "0" : "",
                       second);
}

/// Day number plus the fraction of a day of `length_ns`, `half` a day earlier or not.
std::string day_number(std::int64_t day, std::int64_t ns, std::int64_t length_ns, bool half, int decimals) {
    const Wide one = static_cast<Wide>(power_of_ten(decimals));
    Wide scaled = static_cast<Wide>(day) * one +
                  (static_cast<Wide>(ns) * one * 2 + length_ns) / (2 * static_cast<Wide>(length_ns));
    if (half) scaled -= one / 2;
    return fmt::format("{}.{:0{}}", static_cast<std::int64_t>(scaled / one),
                       static_cast<std::int64_t>(scaled % one), decimals);
}

std::string wide_seconds_text(Wide ns, int decimals) {
    const std::int64_t unit = power_of_ten(9 - decimals);
    if (ns < 0) ns -= unit - 1; // round down, not towards 0
    ns -= ns % unit;
    const Wide size = ns < 0 ? -ns : ns;
    std::string text = fmt::format("{}{}", ns < 0 ? "-" : "", static_cast<std::uint64_t>(size / ns_per_s));
    if (decimals > 0)
        text += fmt::format(".{:09}", static_cast<std::uint64_t>(size % ns_per_s))
                    .substr(0, static_cast<std::size_t>(decimals) + 1);
    return text;
}

std::string count_text(const DayTime& at, TimeScale scale, int decimals) {
    switch (scale) {
    case TimeScale::tai:
        return "PTP " + wide_seconds_text(static_cast<Wide>(at.day) * ns_per_day + at.ns, decimals);
    case TimeScale::tdb:
        return "ET " + wide_seconds_text(static_cast<Wide>(at.day) * ns_per_day + at.ns -
                                             static_cast<Wide>(j2000_s) * ns_per_s,
                                         decimals);
    case TimeScale::gps: {
        if (at.day < gps_epoch_day) throw ConfigError("GPS weeks begin on 1980-01-06");
        const std::int64_t days = at.day - gps_epoch_day;
        return fmt::format("GPS {} {}", days / 7, seconds_text(days % 7 * ns_per_day + at.ns, decimals));
    }
    default:
        throw ConfigError(fmt::format(
            "{} has no count of seconds here: those are TAI (PTP), TDB (ET) and GPS", name_of(scale)));
    }
}

} // namespace

std::string seconds_text(std::int64_t ns, int decimals) {
    return wide_seconds_text(ns, decimals);
}

std::string write_time(Epoch epoch, TimeScale scale, TimeForm form, const LeapSeconds& leap_seconds,
                       int decimals) {
    decimals = std::clamp(decimals, 0, 9);
    const std::int64_t half_ns = power_of_ten(9 - decimals) / 2;
    DayTime at = reading(epoch, scale, leap_seconds);
    if (form == TimeForm::jd || form == TimeForm::mjd) {
        const bool modified = form == TimeForm::mjd;
        return fmt::format("{} {} {}", modified ? "MJD" : "JD",
                           day_number(at.day + (modified ? mjd_of_1970 : jd_of_1970_noon), at.ns,
                                      day_length_ns(at.day, scale, leap_seconds), !modified, decimals + 5),
                           name_of(scale));
    }
    // Round the instant in its scale, so that no second 60 comes of it but a leap second's.
    at.ns += half_ns;
    if (const std::int64_t length_ns = day_length_ns(at.day, scale, leap_seconds); at.ns >= length_ns)
        at = {at.day + 1, at.ns - length_ns};
    if (form == TimeForm::count) return count_text(at, scale, decimals);
    const CalendarDate date = date_of(at.day);
    const std::string time = time_of_day(at.ns, decimals);
    if (form == TimeForm::spice)
        return fmt::format("{:04} {} {:02} {} {}", date.year, month_name(date.month), date.day, time,
                           name_of(scale));
    const std::string suffix = scale == TimeScale::utc ? "Z" : fmt::format(" {}", name_of(scale));
    if (form == TimeForm::day_of_year)
        return fmt::format("{:04}-{:03}T{}{}", date.year, at.day - day_of({date.year, 1, 1}) + 1, time,
                           suffix);
    return fmt::format("{:04}-{:02}-{:02}T{}{}", date.year, date.month, date.day, time, suffix);
}

} // namespace obscura::ephemeris
