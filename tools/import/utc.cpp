// SPDX-License-Identifier: Apache-2.0
#include "tools/import/utc.hpp"

#include <array>
#include <charconv>
#include <chrono>

namespace obscura::tools {
namespace {

/// First days on which TAI - UTC was one second larger; before the first it is 10 s (IERS Bulletin C).
using std::chrono::year;
constexpr std::array leap_days{
    year{1972} / 7 / 1, year{1973} / 1 / 1, year{1974} / 1 / 1, year{1975} / 1 / 1, year{1976} / 1 / 1,
    year{1977} / 1 / 1, year{1978} / 1 / 1, year{1979} / 1 / 1, year{1980} / 1 / 1, year{1981} / 7 / 1,
    year{1982} / 7 / 1, year{1983} / 7 / 1, year{1985} / 7 / 1, year{1988} / 1 / 1, year{1990} / 1 / 1,
    year{1991} / 1 / 1, year{1992} / 7 / 1, year{1993} / 7 / 1, year{1994} / 7 / 1, year{1996} / 1 / 1,
    year{1997} / 7 / 1, year{1999} / 1 / 1, year{2006} / 1 / 1, year{2009} / 1 / 1, year{2012} / 7 / 1,
    year{2015} / 7 / 1, year{2017} / 1 / 1,
};

/// Removes a number and then `separator` from the front of `text`. Separator 0: the end of the text or "Z".
template<typename Number>
bool take(std::string_view& text, Number& number, char separator) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    if (error != std::errc{}) return false;
    text.remove_prefix(static_cast<std::size_t>(end - text.data()));
    if (separator == 0) return text.empty() || text == "Z";
    if (text.empty() || text.front() != separator) return false;
    text.remove_prefix(1);
    return true;
}

} // namespace

std::optional<double> tdb_days_from_j2000(std::string_view utc) {
    int y = 0;
    unsigned month = 0, day = 0;
    int hour = 0, minute = 0;
    double second = 0;
    if (!take(utc, y, '-') || !take(utc, month, '-') || !take(utc, day, 'T') || !take(utc, hour, ':') ||
        !take(utc, minute, ':') || !take(utc, second, 0))
        return std::nullopt;
    const std::chrono::year_month_day date{year{y}, std::chrono::month{month}, std::chrono::day{day}};
    if (!date.ok() || date < leap_days.front() || hour < 0 || hour > 23 || minute < 0 || minute > 59 ||
        !(second >= 0 && second < 61))
        return std::nullopt;
    int tai_minus_utc = 10;
    for (const std::chrono::year_month_day& leap : leap_days)
        if (date >= leap) ++tai_minus_utc;
    const auto days = (std::chrono::sys_days{date} - std::chrono::sys_days{year{2000} / 1 / 1}).count();
    constexpr double tt_minus_tai_s = 32.184;
    return static_cast<double>(days) - 0.5 +
           (hour * 3600 + minute * 60 + second + tai_minus_utc + tt_minus_tai_s) / 86400;
}

} // namespace obscura::tools
