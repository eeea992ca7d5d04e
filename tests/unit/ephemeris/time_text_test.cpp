// SPDX-License-Identifier: Apache-2.0
// Times as text: forms, rounding, leap seconds and messages.
#include "ephemeris/time/time_text.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <string>

namespace time_text_test {

using namespace obscura::ephemeris;
using Catch::Matchers::ContainsSubstring;

namespace {

const LeapSeconds leap_seconds = erfa_leap_seconds();

std::int64_t tai_ns(const char* text) {
    return read_time(text, leap_seconds).tai_ns;
}

} // namespace

TEST_CASE("times of many forms name the same instant", "[ephemeris]") {
    for (const char* text : {"2007-02-28T12:00:00Z",
                             "2007-02-28T12:00:00",
                             "2007-02-28 12:00",
                             " 2007-02-28t12:00:00.000z ",
                             "2007-059T12:00:00Z",
                             "2007-059 // 12:00:00",
                             "2007 FEB 28 12:00:00 UTC",
                             "2007 february 28 12:00",
                             "2007-FEB-28 12:00:00",
                             "28 FEB 2007 12:00:00",
                             "28-Feb-2007 12:00",
                             "Feb 28, 2007 12:00:00",
                             "2007/02/28 12:00:00 utc",
                             "2007-02-28T14:00:00+02:00",
                             "2007-02-27T22:30:00-13:30",
                             "JD 2454160.0",
                             "JDUTC 2454160",
                             "MJD 54159.5 UTC",
                             "jd 2454160.0 utc",
                             "2007-02-28T12:00:33 TAI",
                             "2007-02-28T12:01:05.184 TT",
                             "2007 FEB 28 12:01:05.184 TDT",
                             "2007-02-28T12:00:14 GPS",
                             "PTP 1172664033",
                             "GPS 1416 302414",
                             "ET 225936065.185383388",
                             "2007-02-28T12:01:05.185383388 TDB",
                             "2007 FEB 28 12:01:05.185383388 ET"}) {
        INFO(text);
        CHECK(tai_ns(text) == 1172664033000000000);
    }
    CHECK(tai_ns("2007-02-28") == 1172664033000000000 - 43'200'000'000'000);
    CHECK(tai_ns("PTP -1.5") == -1'500'000'000);
}

TEST_CASE("times are read to the nanosecond and rounded to the nearest", "[ephemeris]") {
    CHECK(tai_ns("PTP 0.1234567894") == 123456789);
    CHECK(tai_ns("PTP 0.1234567895") == 123456790);
    CHECK(tai_ns("PTP 0.12345678949999999999999999") == 123456789);
    CHECK(tai_ns("2007-02-28T11:59:59.9999999999Z") == 1172664033000000000);
    CHECK(tai_ns("2016-12-31T23:59:59.9999999999Z") == 1483228836000000000); // the leap second begins
    // A day with a leap second is divided into 86401 s, as by ERFA.
    CHECK(tai_ns("MJD 57753.5 UTC") == tai_ns("2016-12-31T12:00:00.5Z"));
    CHECK(tai_ns("JD 2457754.0 TAI") == tai_ns("2016-12-31T12:00:00 TAI"));
}

TEST_CASE("second 60 is read and written in a leap second only", "[ephemeris]") {
    CHECK(tai_ns("2016-12-31T23:59:60.25Z") == 1483228836250000000);
    CHECK(tai_ns("2017-01-01T00:00:00Z") - tai_ns("2016-12-31T23:59:59Z") == 2'000'000'000);
    CHECK(write_time({1483228836250000000}, TimeScale::utc, TimeForm::iso, leap_seconds) ==
          "2016-12-31T23:59:60.250000000Z");
    CHECK(write_time({1483228836250000000}, TimeScale::gps, TimeForm::iso, leap_seconds, 2) ==
          "2017-01-01T00:00:17.25 GPS");
    CHECK(write_time({1483228835999999999}, TimeScale::utc, TimeForm::spice, leap_seconds, 3) ==
          "2016 DEC 31 23:59:60.000 UTC");
    CHECK(write_time({1483228836999999999}, TimeScale::utc, TimeForm::day_of_year, leap_seconds, 0) ==
          "2017-001T00:00:00Z");
}

TEST_CASE("an instant is written in each form", "[ephemeris]") {
    constexpr Epoch epoch{1172664033500000000};
    const auto text = [&](TimeScale scale, TimeForm form, int decimals = 9) {
        return write_time(epoch, scale, form, leap_seconds, decimals);
    };
    CHECK(text(TimeScale::utc, TimeForm::iso) == "2007-02-28T12:00:00.500000000Z");
    CHECK(text(TimeScale::tai, TimeForm::iso, 1) == "2007-02-28T12:00:33.5 TAI");
    CHECK(text(TimeScale::tdb, TimeForm::spice) == "2007 FEB 28 12:01:05.685383388 TDB");
    CHECK(text(TimeScale::tt, TimeForm::day_of_year, 0) == "2007-059T12:01:06 TT");
    CHECK(text(TimeScale::utc, TimeForm::jd) == "JD 2454160.00000578703704 UTC");
    CHECK(text(TimeScale::utc, TimeForm::mjd, 1) == "MJD 54159.500006 UTC");
    CHECK(text(TimeScale::tai, TimeForm::count) == "PTP 1172664033.500000000");
    CHECK(text(TimeScale::tdb, TimeForm::count, 3) == "ET 225936065.685");
    CHECK(text(TimeScale::gps, TimeForm::count, 0) == "GPS 1416 302415");
    CHECK_THROWS_WITH(text(TimeScale::utc, TimeForm::count),
                      ContainsSubstring("UTC has no count of seconds"));
    CHECK(write_time({-1}, TimeScale::tai, TimeForm::count, leap_seconds) == "PTP -0.000000001");
    CHECK_THROWS_WITH(write_time({0}, TimeScale::gps, TimeForm::count, leap_seconds),
                      ContainsSubstring("GPS weeks begin on 1980-01-06"));
}

TEST_CASE("what is no time is refused with its place and what is allowed", "[ephemeris]") {
    struct Case {
        const char *text, *message;
    };
    for (const Case& c : {
             Case{"", "time \"\": character 1: is empty"},
             Case{"2007-13-01", "time \"2007-13-01\": character 6: month 13, allowed is 1 to 12"},
             Case{"2007-02-29", "character 9: day 29, allowed is 1 to 28 in FEB 2007"},
             Case{"2007-366", "character 6: day of the year 366, allowed is 1 to 365"},
             Case{"2007-02-28T24:00:00Z", "character 12: hour 24, allowed is 0 to 23"},
             Case{"2007-02-28T12:60:00Z", "character 15: minute 60"},
             Case{"2007-02-28T12:00:61Z", "character 18: second 61"},
             Case{"2007-02-28T23:59:60Z", "character 18: second 60 without a leap second"},
             Case{"2016-12-31T23:59:60 TAI",
                  "character 18: second 60 without a leap second, allowed is 0 to 59: only UTC"},
             Case{"2016-12-31T12:59:60Z", "character 18: second 60 without a leap second"},
             Case{"2007-02-28T12", "character 14: no minute after the hour"},
             Case{"2007-02-28T12:00:00 EST",
                  "character 21: time scale \"EST\", allowed is UTC, TAI, TT, TDT, TDB, ET or GPS"},
             Case{"2007-02-28T12:00:00Z TDB", "character 20: time scale \"Z\""},
             Case{"2007 FOO 28", "character 6: month \"FOO\""},
             Case{"yesterday", "character 1: \"YESTERDAY\" begins no time"},
             Case{"07-02-28", "character 4: no month after the day"},
             Case{"20070228", "character 1: a year of 8 digits, allowed is four digits"},
             Case{"1600-01-01 TDB", "character 1: year 1600, allowed is 1678 to 2261"},
             Case{"1959-12-31T00:00:00Z", "character 1: UTC begins in 1960"},
             Case{"JD", "character 3: a day number is wanted here"},
             Case{"JD 1.0 TDB", "character 4: outside the instants that can be held"},
             Case{"GPS 1416", "character 9: no seconds after the GPS week"},
             Case{"GPS 1416 604800", "character 10: second of the GPS week 604800"},
             Case{"PTP 99999999999", "character 5: outside the instants"},
             Case{"PTP 1 UTC", "character 7: the time has ended before this"},
             Case{"1999999999999999999999",
                  "character 1: a year or a day is wanted here, allowed is 1 to 12 digits"},
             Case{"2007-02-28T12:00:00+15:00", "character 21: hour of the offset 15"},
         }) {
        INFO(c.text);
        CHECK_THROWS_WITH(read_time(c.text, leap_seconds), ContainsSubstring(c.message));
    }
    // Bytes that a terminal would obey do not reach a message.
    CHECK_THROWS_WITH(read_time("2007\x1b[2J", leap_seconds), !ContainsSubstring("\x1b"));
}

} // namespace time_text_test
