// SPDX-License-Identifier: Apache-2.0
#include "config/document.hpp"
#include "core/text/printable.hpp"
#include "ephemeris/time/calendar.hpp"
#include "ephemeris/time/time_text.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>

namespace obscura::ephemeris {
namespace {

__extension__ using Wide = __int128;

constexpr std::int64_t j2000_day = 10957;

constexpr bool is_digit(char c) {
    return c >= '0' && c <= '9';
}
constexpr bool is_letter(char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}
constexpr char capital(char c) {
    return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
}

/// A decimal number of the text, kept exactly.
struct Number {
    std::size_t at = 0;
    bool negative = false;
    std::size_t digits = 0; ///< before the point
    std::int64_t whole = 0;
    /// Digits after the point: value and power of ten.
    std::int64_t fraction = 0, fraction_scale = 1;
    bool has_point = false;

    /// The fraction of `unit`, rounded to the nearest integer.
    [[nodiscard]] std::int64_t fraction_of(std::int64_t unit) const {
        return static_cast<std::int64_t>((static_cast<Wide>(fraction) * unit * 2 + fraction_scale) /
                                         (static_cast<Wide>(fraction_scale) * 2));
    }
};

class TimeReader {
public:
    TimeReader(std::string_view text, const LeapSeconds& leap_seconds, TimeScale scale)
        : text_(text), leap_seconds_(leap_seconds), scale_(scale) {}

    Epoch read() {
        skip_space();
        if (at_ == text_.size()) fail(0, "is empty", time_forms);
        if (is_letter(peek())) {
            const std::size_t begin = at_;
            const std::string first = word();
            if (first == "JD" || first == "JDUTC")
                return julian_date(false, first == "JD" ? scale_ : TimeScale::utc);
            if (first == "JDTDB") return julian_date(false, TimeScale::tdb);
            if (first == "JDTDT" || first == "JDTT") return julian_date(false, TimeScale::tt);
            if (first == "MJD") return julian_date(true, scale_);
            if (first == "ET") return count(TimeScale::tdb, j2000_day * ns_per_day + ns_per_day / 2);
            if (first == "PTP") return count(TimeScale::tai, 0);
            if (first == "GPS") return gps_week();
            at_ = begin;
            if (month_named(first) == 0)
                fail(begin, fmt::format("\"{}\" begins no time", printable(first, 20)), time_forms);
        }
        return calendar();
    }

private:
    [[noreturn]] void fail(std::size_t at, std::string_view what, std::string_view allowed) const {
        throw TimeTextError(text_, at, fmt::format("{}, allowed is {}", what, allowed));
    }
    [[nodiscard]] char peek() const { return at_ < text_.size() ? text_[at_] : '\0'; }
    bool take(char c) {
        if (peek() != c) return false;
        ++at_;
        return true;
    }
    bool skip_space() {
        const std::size_t before = at_;
        while (peek() == ' ' || peek() == '\t')
            ++at_;
        return at_ != before;
    }
    /// Letters from here on, in capitals.
    std::string word() {
        std::string read;
        while (is_letter(peek()))
            read += capital(text_[at_++]);
        return read;
    }

    /// Digits, with a fraction if `with_fraction`.
    Number number(std::string_view what, bool with_fraction, bool with_sign = false) {
        Number read;
        read.at = at_;
        if (with_sign && (peek() == '-' || peek() == '+')) read.negative = text_[at_++] == '-';
        for (; is_digit(peek()); ++at_, ++read.digits)
            if (read.digits < 12) read.whole = read.whole * 10 + (peek() - '0');
        if (read.digits == 0 || read.digits > 12)
            fail(read.at, fmt::format("{} is wanted here", what), "1 to 12 digits");
        if (!with_fraction || !take('.')) return read;
        read.has_point = true;
        // Digits beyond the 18th are below any nanosecond, also of a day's fraction.
        for (std::size_t digits = 0; is_digit(peek()); ++at_, ++digits)
            if (digits < 18) {
                read.fraction = read.fraction * 10 + (peek() - '0');
                read.fraction_scale *= 10;
            }
        return read;
    }

    std::int64_t in_range(const Number& number, std::string_view what, std::int64_t least,
                          std::int64_t most) {
        if (number.whole < least || number.whole > most)
            fail(number.at, fmt::format("{} {}", what, number.whole), fmt::format("{} to {}", least, most));
        return number.whole;
    }

    /// The scale at the end of the text, or `scale` if there is none.
    TimeScale end(TimeScale scale) {
        skip_space();
        const std::size_t begin = at_;
        if (is_letter(peek())) {
            const std::string name = word();
            if (const auto named = enum_named<TimeScale>(name))
                scale = *named;
            else if (name == "TDT")
                scale = TimeScale::tt;
            else if (name == "ET")
                scale = TimeScale::tdb;
            else
                fail(begin, fmt::format("time scale \"{}\"", printable(name, 20)),
                     "UTC, TAI, TT, TDT, TDB, ET or GPS");
        }
        skip_space();
        if (at_ != text_.size()) fail(at_, "the time has ended before this", "nothing more");
        return scale;
    }

    Epoch at(const DayTime& reading, TimeScale scale, std::size_t begin) {
        if (reading.day < first_day || reading.day > last_day)
            fail(begin, "outside the instants that can be held", "1678 to 2261");
        if (scale == TimeScale::utc && reading.day < first_utc_day)
            fail(begin, "UTC begins in 1960", "before it TT or TDB");
        return epoch_of(reading, scale, leap_seconds_);
    }

    Epoch julian_date(bool modified, TimeScale scale) {
        skip_space();
        const Number date = number("a day number", true);
        scale = end(scale);
        // Make a modified Julian date of it, whose days are those of the calendar; half a day may carry.
        std::int64_t day = date.whole - mjd_of_1970, halves = 0;
        if (!modified) {
            day = date.whole - 2'400'001 - mjd_of_1970;
            halves = 1;
        }
        Wide fraction =
            static_cast<Wide>(date.fraction) * 2 + halves * static_cast<Wide>(date.fraction_scale);
        const Wide one = static_cast<Wide>(date.fraction_scale) * 2;
        if (fraction >= one) {
            fraction -= one;
            ++day;
        }
        if (day < first_day || day > last_day || (scale == TimeScale::utc && day < first_utc_day))
            return at({day, 0}, scale, date.at);
        const Wide length = day_length_ns(day, scale, leap_seconds_);
        return at({day, static_cast<std::int64_t>((fraction * length * 2 + one) / (one * 2))}, scale,
                  date.at);
    }

    /// Seconds of `scale` since `zero_ns` after 1970.
    Epoch count(TimeScale scale, std::int64_t zero_ns) {
        skip_space();
        const Number seconds = number("a number of seconds", true, true);
        (void)end_without_scale();
        return counted(seconds, scale, zero_ns);
    }

    Epoch gps_week() {
        skip_space();
        const Number week = number("a GPS week", false);
        (void)in_range(week, "GPS week", 0, 14'000);
        if (!skip_space()) fail(at_, "no seconds after the GPS week", "\"GPS week seconds\"");
        const Number seconds = number("seconds of the GPS week", true);
        (void)in_range(seconds, "second of the GPS week", 0, 604'799);
        (void)end_without_scale();
        return counted(seconds, TimeScale::gps, (gps_epoch_day + week.whole * 7) * ns_per_day);
    }

    bool end_without_scale() {
        skip_space();
        if (at_ != text_.size()) fail(at_, "the time has ended before this", "nothing more");
        return true;
    }

    Epoch counted(const Number& seconds, TimeScale scale, std::int64_t zero_ns) {
        Wide ns = static_cast<Wide>(seconds.whole) * ns_per_s + seconds.fraction_of(ns_per_s);
        if (seconds.negative) ns = -ns;
        ns += zero_ns;
        Wide day = ns / ns_per_day, rest = ns % ns_per_day;
        if (rest < 0) {
            rest += ns_per_day;
            --day;
        }
        const Wide most = last_day + 1;
        return at({static_cast<std::int64_t>(std::clamp(day, -most, most)), static_cast<std::int64_t>(rest)},
                  scale, seconds.at);
    }

    /// Date, time of day, scale.
    Epoch calendar() {
        const std::size_t begin = at_;
        const std::int64_t day = date();
        const TimeOfDay time = time_of_day();
        std::int64_t offset_ns = 0;
        const TimeScale scale = zone(offset_ns);
        const std::int64_t ns = checked(time, day, scale, begin);
        if (offset_ns == 0) return at({day, ns}, scale, begin);
        if (ns >= ns_per_day) fail(time.second_at, "second 60 beside an offset", "UTC, \"Z\"");
        DayTime shifted{day, ns - offset_ns};
        if (shifted.ns < 0) shifted = {day - 1, shifted.ns + ns_per_day};
        if (shifted.ns >= ns_per_day) shifted = {shifted.day + 1, shifted.ns - ns_per_day};
        return at(shifted, scale, begin);
    }

    struct TimeOfDay {
        std::int64_t minute = 0;    ///< of the day
        std::int64_t second_ns = 0; ///< of the minute
        std::size_t second_at = 0;
    };

    static constexpr std::string_view between = " \t-/,";
    void skip_between() {
        while (at_ < text_.size() && between.find(peek()) != std::string_view::npos)
            ++at_;
    }

    int month() {
        const std::size_t begin = at_;
        const std::string name = word();
        const int found = month_named(name);
        if (found == 0) fail(begin, fmt::format("month \"{}\"", printable(name, 20)), "JAN to DEC");
        return found;
    }

    std::int64_t date() {
        CalendarDate found;
        std::size_t day_at = at_;
        if (is_letter(peek())) { // FEB 28, 2007
            found.month = month();
            skip_between();
            day_at = at_;
            found.day = day_of_month();
            skip_between();
            found.year = year();
            return day_in_month(found, day_at);
        }
        const Number first = number("a year or a day", false);
        if (first.digits <= 2) { // 28 FEB 2007
            skip_between();
            if (!is_letter(peek()))
                fail(at_, "no month after the day", "years have four digits, months JAN to DEC");
            found.day = static_cast<int>(in_range(first, "day", 1, 31));
            found.month = month();
            skip_between();
            found.year = year();
            return day_in_month(found, day_at);
        }
        found.year = year_from(first);
        if (at_ == text_.size())
            fail(at_, "no month or day after the year", "\"2007-02-28\", \"2007-059\" or \"2007 FEB 28\"");
        if (!(peek() == '-' || peek() == ' ' || peek() == '/' || is_letter(peek())))
            fail(at_, "no month or day after the year", "\"2007-02-28\", \"2007-059\" or \"2007 FEB 28\"");
        skip_between();
        if (is_letter(peek())) {
            found.month = month();
            skip_between();
            day_at = at_;
            found.day = day_of_month();
            return day_in_month(found, day_at);
        }
        const Number second = number("a month or a day of the year", false);
        if (second.digits == 3) {
            const std::int64_t day = in_range(second, "day of the year", 1, days_in_year(found.year));
            // SPICE writes "2001-039 // 17:24".
            const std::size_t after = at_;
            skip_space();
            if (!(take('/') && take('/'))) at_ = after;
            return day_of({found.year, 1, 1}) + day - 1;
        }
        found.month = static_cast<int>(in_range(second, "month", 1, 12));
        if (!take('-') && !take('/')) fail(at_, "no day after the month", "\"-\" and the day of the month");
        day_at = at_;
        found.day = day_of_month();
        return day_in_month(found, day_at);
    }

    int year_from(const Number& number) {
        if (number.digits != 4)
            fail(number.at, fmt::format("a year of {} digits", number.digits), "four digits");
        return static_cast<int>(in_range(number, "year", 1678, 2261));
    }
    int year() { return year_from(number("a year", false)); }
    int day_of_month() {
        return static_cast<int>(in_range(number("a day of the month", false), "day", 1, 31));
    }
    std::int64_t day_in_month(const CalendarDate& date, std::size_t day_at) {
        const int most = days_in_month(date.year, date.month);
        if (date.day > most)
            fail(day_at, fmt::format("day {}", date.day),
                 fmt::format("1 to {} in {} {}", most, month_name(date.month), date.year));
        return day_of(date);
    }

    TimeOfDay time_of_day() {
        TimeOfDay time;
        const bool letter =
            (peek() == 'T' || peek() == 't') && is_digit(text_[std::min(at_ + 1, text_.size() - 1)]);
        if (letter)
            ++at_;
        else
            skip_space();
        if (!is_digit(peek())) return time;
        const Number hour = number("an hour", false);
        (void)in_range(hour, "hour", 0, 23);
        if (!take(':')) fail(at_, "no minute after the hour", "\":\" and two digits");
        const Number minute = number("a minute", false);
        (void)in_range(minute, "minute", 0, 59);
        time.minute = hour.whole * 60 + minute.whole;
        time.second_at = at_;
        if (!take(':')) return time;
        const Number second = number("a second", true);
        (void)in_range(second, "second", 0, 60);
        time.second_at = second.at;
        time.second_ns = second.whole * ns_per_s + second.fraction_of(ns_per_s);
        return time;
    }

    /// "Z", an offset from UTC, or a scale.
    TimeScale zone(std::int64_t& offset_ns) {
        if ((peek() == 'Z' || peek() == 'z') && at_ + 1 == text_.size()) {
            ++at_;
            return TimeScale::utc;
        }
        const std::size_t before = at_;
        if (take('+') || take('-')) {
            const Number hour = number("an hour", false);
            (void)in_range(hour, "hour of the offset", 0, 14);
            if (!take(':')) fail(at_, "no minute after the hour of the offset", "\"+02:00\"");
            const Number minute = number("a minute", false);
            (void)in_range(minute, "minute of the offset", 0, 59);
            offset_ns = (hour.whole * 60 + minute.whole) * 60 * ns_per_s * (text_[before] == '-' ? -1 : 1);
            (void)end_without_scale();
            return TimeScale::utc;
        }
        return end(scale_);
    }

    /// Time of day in ns, if the day has it.
    std::int64_t checked(const TimeOfDay& time, std::int64_t day, TimeScale scale, std::size_t begin) {
        const std::int64_t ns = time.minute * 60 * ns_per_s + time.second_ns;
        if (day < first_day || day > last_day || (scale == TimeScale::utc && day < first_utc_day))
            return at({day, 0}, scale, begin), 0;
        const std::int64_t length_ns = day_length_ns(day, scale, leap_seconds_);
        const bool last_minute = time.minute == 24 * 60 - 1;
        const bool leap = last_minute && length_ns > ns_per_day;
        // A fraction of more than nine digits may round up to the end of the minute.
        const std::int64_t max_second_ns = leap ? length_ns - time.minute * 60 * ns_per_s : 60 * ns_per_s;
        const bool written_60 = time.second_ns >= 60 * ns_per_s && text_[time.second_at] == '6';
        if (written_60 && !leap)
            fail(time.second_at, "second 60 without a leap second",
                 scale == TimeScale::utc
                     ? fmt::format("0 to 59, or 60 at the end of a day with one (leap seconds of {})",
                                   leap_seconds_.source)
                     : "0 to 59: only UTC has leap seconds");
        if (time.second_ns > max_second_ns || (last_minute && length_ns < ns_per_day && ns >= length_ns))
            fail(time.second_at, "a second that this day does not have",
                 fmt::format("up to {} s", seconds_text(length_ns - time.minute * 60 * ns_per_s)));
        return ns;
    }

    std::string_view text_;
    const LeapSeconds& leap_seconds_;
    TimeScale scale_;
    std::size_t at_ = 0;
};

} // namespace

TimeTextError::TimeTextError(std::string_view text, std::size_t at, std::string_view what)
    : ConfigError(fmt::format("time \"{}\": character {}: {}", printable(text, 60), at + 1, what)), at_(at) {}

Epoch read_time(std::string_view text, const LeapSeconds& leap_seconds, TimeScale scale) {
    while (!text.empty() && (text.back() == ' ' || text.back() == '\t'))
        text.remove_suffix(1);
    return TimeReader(text, leap_seconds, scale).read();
}

} // namespace obscura::ephemeris
