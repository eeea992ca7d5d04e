// SPDX-License-Identifier: Apache-2.0
// Proleptic Gregorian calendar: dates and day numbers.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace obscura::ephemeris {

inline constexpr std::int64_t ns_per_s = 1'000'000'000;
inline constexpr std::int64_t ns_per_day = 86'400 * ns_per_s;

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
