// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/time/calendar.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <chrono>

namespace obscura::ephemeris {
namespace {

constexpr std::array<std::string_view, 12> month_names{"JANUARY",   "FEBRUARY", "MARCH",    "APRIL",
                                                       "MAY",       "JUNE",     "JULY",     "AUGUST",
                                                       "SEPTEMBER", "OCTOBER",  "NOVEMBER", "DECEMBER"};

std::chrono::year_month_day to_chrono(const CalendarDate& date) {
    return std::chrono::year{date.year} / date.month / date.day;
}

bool is_same_word(std::string_view text, std::string_view capitals) {
    return std::equal(text.begin(), text.end(), capitals.begin(), capitals.end(),
                      [](char a, char b) { return (a >= 'a' && a <= 'z' ? a - 'a' + 'A' : a) == b; });
}

} // namespace

bool is_valid(const CalendarDate& date) {
    return date.year >= -9999 && date.year <= 9999 && date.month >= 1 && date.month <= 12 && date.day >= 1 &&
           date.day <= days_in_month(date.year, date.month);
}

std::int64_t day_of(const CalendarDate& date) {
    return std::chrono::sys_days{to_chrono(date)}.time_since_epoch().count();
}

CalendarDate date_of(std::int64_t day) {
    const std::chrono::year_month_day date{std::chrono::sys_days{std::chrono::days{day}}};
    return {static_cast<int>(date.year()), static_cast<int>(static_cast<unsigned>(date.month())),
            static_cast<int>(static_cast<unsigned>(date.day()))};
}

int days_in_month(int year, int month) {
    const std::chrono::year_month_day_last last{
        std::chrono::year{year},
        std::chrono::month_day_last{std::chrono::month{static_cast<unsigned>(month)}}};
    return static_cast<int>(static_cast<unsigned>(last.day()));
}

int days_in_year(int year) {
    return std::chrono::year{year}.is_leap() ? 366 : 365;
}

std::string date_text(std::int64_t day) {
    const CalendarDate date = date_of(day);
    return fmt::format("{:04}-{:02}-{:02}", date.year, date.month, date.day);
}

int month_named(std::string_view name) {
    for (std::size_t i = 0; i < month_names.size(); ++i)
        if (is_same_word(name, month_names[i]) || is_same_word(name, month_names[i].substr(0, 3)))
            return static_cast<int>(i) + 1;
    return 0;
}

std::string_view month_name(int month) {
    return month_names.at(static_cast<std::size_t>(month - 1)).substr(0, 3);
}

} // namespace obscura::ephemeris
