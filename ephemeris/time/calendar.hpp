// SPDX-License-Identifier: Apache-2.0
// Proleptic Gregorian calendar: dates and day numbers.
#pragma once

#include "core/time.hpp"

#include <cstdint>
#include <string>
#include <string_view>

namespace obscura::ephemeris {

inline constexpr std::int64_t ns_per_day = 86'400 * ns_per_s;
/// Days since 1970-01-01 of the GPS epoch, 1980-01-06.
inline constexpr std::int64_t gps_epoch_day = 3657;
/// J2000, 2000-01-01T12:00:00, in s from 1970-01-01T00:00:00 of the same scale.
inline constexpr std::int64_t j2000_s = 10957 * 86'400 + 43'200;
/// Modified Julian date of 1970-01-01.
inline constexpr std::int64_t mjd_of_1970 = 40587;

/// Date of the proleptic Gregorian calendar.
struct CalendarDate {
    int year = 1970;
    int month = 1; ///< 1 to 12
    int day = 1;   ///< of the month, from 1
};

[[nodiscard]] bool is_valid(const CalendarDate& date);
/// Days since 1970-01-01. The date must be valid.
[[nodiscard]] std::int64_t day_of(const CalendarDate& date);
[[nodiscard]] CalendarDate date_of(std::int64_t day);
[[nodiscard]] int days_in_month(int year, int month);
[[nodiscard]] int days_in_year(int year);
/// "2007-02-28"
[[nodiscard]] std::string date_text(std::int64_t day);
/// 1 to 12 for an English name of three letters or in full, of any case; 0 for any other text.
[[nodiscard]] int month_named(std::string_view name);
/// "JAN" for 1.
[[nodiscard]] std::string_view month_name(int month);

} // namespace obscura::ephemeris
