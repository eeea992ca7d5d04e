// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/time/leap_seconds.hpp"

#include "core/error.hpp"
#include "core/io/text_file.hpp"
#include "ephemeris/time/calendar.hpp"

#include <erfa.h>
#include <erfaextra.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <string_view>

namespace obscura::ephemeris {
namespace {

/// First day of leap seconds, 1972-01-01: before, UTC had a rate of its own.
constexpr std::int64_t first_step_day = 730;
/// NTP counts seconds from 1900.
constexpr std::int64_t ntp_of_1970_s = 2'208'988'800;
constexpr std::size_t max_list_bytes = 1 << 20;

[[noreturn]] void fail(const std::string& name, std::size_t line, const std::string& what) {
    throw ConfigError(fmt::format("{}:{}: {}", name, line, what));
}

/// TAI - UTC by ERFA at a fraction of a day, s.
double erfa_tai_minus_utc(std::int64_t day, double fraction) {
    const CalendarDate date = date_of(day);
    double delta = 0;
    eraDat(date.year, date.month, date.day, fraction, &delta);
    return delta;
}

std::int32_t tai_minus_utc_s(std::int64_t day, const LeapSeconds& leap_seconds) {
    const auto after = std::upper_bound(leap_seconds.steps.begin(), leap_seconds.steps.end(), day,
                                        [](std::int64_t d, const LeapSecond& step) { return d < step.day; });
    return after == leap_seconds.steps.begin() ? after->tai_minus_utc_s : (after - 1)->tai_minus_utc_s;
}

/// Day before 1972, see eraUtctai(): the change of TAI - UTC over the day is a rate, up to twice what it is
/// at noon, and a step at its end.
UtcDay early_utc_day(std::int64_t day) {
    const double begin_s = erfa_tai_minus_utc(day, 0), noon_s = erfa_tai_minus_utc(day, 0.5);
    const double rate_s = 2 * (noon_s - begin_s);
    const double step_s = erfa_tai_minus_utc(day + 1, 0) - (begin_s + rate_s);
    return {day * ns_per_day + std::llround(begin_s * 1e9), ns_per_day + std::llround(step_s * 1e9),
            rate_s / 86400};
}

template<typename Number>
bool parse(std::string_view text, Number& number) {
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
    return error == std::errc{} && end == text.data() + text.size();
}

/// Lines of an IERS list: "seconds since 1900, TAI - UTC", "#@ expiry".
LeapSeconds parse_iers(const std::string& text, const std::string& name) {
    LeapSeconds read;
    std::istringstream lines(text);
    std::string line;
    for (std::size_t number = 1; std::getline(lines, line); ++number) {
        std::istringstream words(line);
        std::string first, second;
        words >> first >> second;
        std::int64_t seconds = 0;
        if (first == "#@") {
            if (!parse(second, seconds) || seconds < 0)
                fail(name, number, "\"#@\" is not followed by seconds since 1900");
            read.expires_utc_s = seconds - ntp_of_1970_s;
        }
        if (first.empty() || first.front() == '#') continue;
        LeapSecond step;
        if (!parse(first, seconds) || !parse(second, step.tai_minus_utc_s))
            fail(name, number, "wanted is \"seconds since 1900, TAI - UTC in s\"");
        if (seconds < 0 || seconds > 4 * ntp_of_1970_s || (seconds - ntp_of_1970_s) % 86400 != 0)
            fail(name, number, fmt::format("{} s since 1900 is not the beginning of a UTC day", seconds));
        step.day = (seconds - ntp_of_1970_s) / 86400;
        read.steps.push_back(step);
    }
    return read;
}

/// The pairs "seconds, @date" of DELTET/DELTA_AT in the data blocks of a text kernel.
LeapSeconds parse_kernel(const std::string& text, const std::string& name) {
    LeapSeconds read;
    std::istringstream lines(text);
    std::string line, word;
    bool data = false, within = false, has_value = false;
    std::int32_t value = 0;
    for (std::size_t number = 1; std::getline(lines, line); ++number) {
        std::replace_if(
            line.begin(), line.end(), [](char c) { return c == ',' || c == '\t'; }, ' ');
        std::string spaced;
        for (const char c : line)
            spaced += c == '(' || c == ')' || c == '=' ? std::string{' ', c, ' '} : std::string(1, c);
        std::istringstream words(spaced);
        while (words >> word) {
            if (word == "\\begindata" || word == "\\begintext") {
                data = word == "\\begindata";
                continue;
            }
            if (!data) break;
            if (word == "DELTET/DELTA_AT") {
                within = true;
                read.steps.clear();
                continue;
            }
            if (!within || word == "=" || word == "(") continue;
            if (word == ")") {
                within = false;
                continue;
            }
            if (!has_value) {
                if (!parse(word, value))
                    fail(name, number, fmt::format("DELTET/DELTA_AT: \"{}\" is no whole number", word));
                has_value = true;
                continue;
            }
            // "@1972-JAN-1"
            CalendarDate date;
            const std::size_t dash = word.find('-'), second = word.find('-', dash + 1);
            if (word.front() != '@' || second == std::string::npos ||
                !parse(std::string_view(word).substr(1, dash - 1), date.year) ||
                !parse(std::string_view(word).substr(second + 1), date.day) ||
                (date.month = month_named(std::string_view(word).substr(dash + 1, second - dash - 1))) == 0 ||
                !is_valid(date))
                fail(name, number, fmt::format("DELTET/DELTA_AT: \"{}\" is no date like @1972-JAN-1", word));
            read.steps.push_back({day_of(date), value});
            has_value = false;
        }
    }
    return read;
}

} // namespace

UtcDay utc_day(std::int64_t day, const LeapSeconds& leap_seconds) {
    if (day < first_utc_day) throw ConfigError("UTC begins in 1960: before, a time in TT or TDB is wanted");
    if (day < first_step_day) return early_utc_day(day);
    constexpr std::int64_t ns = ns_per_s;
    const std::int64_t offset_s = tai_minus_utc_s(day, leap_seconds);
    return {day * ns_per_day + offset_s * ns,
            ns_per_day + (tai_minus_utc_s(day + 1, leap_seconds) - offset_s) * ns, 0};
}

LeapSeconds parse_leap_seconds(const std::string& text, const std::string& name) {
    LeapSeconds read =
        text.find("\\begindata") != std::string::npos ? parse_kernel(text, name) : parse_iers(text, name);
    read.source = name;
    validate(read, name);
    return read;
}

LeapSeconds read_leap_seconds(const std::filesystem::path& file) {
    std::string text;
    if (const std::string why = read_plain_text(file, max_list_bytes, text, InputKind::system); !why.empty())
        throw ConfigError(fmt::format("{}: cannot be read: {}", file.string(), why));
    return parse_leap_seconds(text, file.string());
}

void validate(const LeapSeconds& leap_seconds, const std::string& name) {
    const auto& steps = leap_seconds.steps;
    if (steps.empty())
        throw ConfigError(fmt::format(
            "{}: no leap seconds (DELTET/DELTA_AT, or lines \"seconds since 1900, TAI - UTC\")", name));
    if (steps.front() != LeapSecond{first_step_day, 10})
        throw ConfigError(fmt::format("{}: the leap seconds do not begin with 10 s on 1972-01-01", name));
    for (std::size_t i = 1; i < steps.size(); ++i) {
        const std::string place = fmt::format("{}: leap second of {}", name, date_text(steps[i].day));
        if (steps[i].day <= steps[i - 1].day)
            throw ConfigError(fmt::format("{} does not come after {}", place, date_text(steps[i - 1].day)));
        if (std::abs(steps[i].tai_minus_utc_s - steps[i - 1].tai_minus_utc_s) != 1)
            throw ConfigError(fmt::format("{}: TAI - UTC goes from {} s to {} s, allowed are steps of 1 s",
                                          place, steps[i - 1].tai_minus_utc_s, steps[i].tai_minus_utc_s));
    }
}

LeapSeconds erfa_leap_seconds() {
    eraLEAPSECOND* table = nullptr;
    const int count = eraGetLeapSeconds(&table);
    LeapSeconds read;
    read.source = "ERFA";
    for (int i = 0; i < count; ++i) {
        const std::int64_t day = day_of({table[i].iyear, table[i].month, 1});
        if (day >= first_step_day)
            read.steps.push_back({day, static_cast<std::int32_t>(std::lround(table[i].delat))});
    }
    return read;
}

LeapSeconds system_leap_seconds() {
    LeapSeconds erfa = erfa_leap_seconds();
    try {
        LeapSeconds system = read_leap_seconds(system_leap_second_file);
        if (system.steps.size() >= erfa.steps.size()) return system;
    } catch (const ConfigError&) {
        // No list, or a damaged one: ERFA's table is the documented substitute.
    }
    return erfa;
}

} // namespace obscura::ephemeris
