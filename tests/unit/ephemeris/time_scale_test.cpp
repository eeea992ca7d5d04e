// SPDX-License-Identifier: Apache-2.0
// Time scales and leap seconds against python3-erfa.
#include "core/error.hpp"
#include "ephemeris/time/calendar.hpp"
#include "ephemeris/time/time_text.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <string>

namespace time_scale_test {

using namespace obscura;
using namespace obscura::ephemeris;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Nanoseconds since 1970-01-01 of the scale.
std::int64_t count_ns(Epoch epoch, TimeScale scale) {
    const DayTime at = reading(epoch, scale, erfa_leap_seconds());
    return at.day * ns_per_day + at.ns;
}

std::string utc(Epoch epoch) {
    return write_time(epoch, TimeScale::utc, TimeForm::iso, erfa_leap_seconds());
}

} // namespace

TEST_CASE("UTC, TAI, TT and TDB agree with python3-erfa to a nanosecond", "[ephemeris]") {
    struct Case {
        const char* utc;
        std::int64_t tai_ns, tt_ns, tdb_ns;
    };
    // python3-erfa 2.0.0.1: dtf2d(), utctai(), taitt(), dtdb() at the geocentre, tttdb(), in exact fractions.
    constexpr std::array cases{
        Case{"1960-01-01T00:00:00.000000000Z", -315619199056518000, -315619166872518000, -315619166872588704},
        Case{"1961-07-31T23:59:59.500000000Z", -265679998802430008, -265679966618430007, -265679966619184390},
        Case{"1965-06-15T12:00:00.250000000Z", -143467195895381996, -143467163711381996, -143467163710849341},
        Case{"1968-01-31T23:59:59.875000000Z", -60479993839318004, -60479961655318004, -60479961654526892},
        Case{"1971-12-31T23:59:59.000000000Z", 63072008892241970, 63072041076241970, 63072041076159655},
        Case{"1971-12-31T23:59:60.062500000Z", 63072009954742002, 63072042138742002, 63072042138659687},
        Case{"1972-01-01T00:00:00.000000000Z", 63072010000000000, 63072042184000000, 63072042183917686},
        Case{"1972-06-30T23:59:60.500000000Z", 78796810500000000, 78796842684000000, 78796842684087223},
        Case{"1999-12-31T23:59:59.999999999Z", 946684831999999999, 946684864183999999, 946684864183886257},
        Case{"2000-01-01T11:58:55.816000000Z", 946727967816000000, 946728000000000000, 946727999999900693},
        Case{"2007-02-28T12:00:00.000000000Z", 1172664033000000000, 1172664065184000000, 1172664065185383388},
        Case{"2016-12-31T23:59:59.000000000Z", 1483228835000000000, 1483228867184000000, 1483228867183950503},
        Case{"2016-12-31T23:59:60.000000000Z", 1483228836000000000, 1483228868184000000, 1483228868183950503},
        Case{"2016-12-31T23:59:60.999999999Z", 1483228836999999999, 1483228869183999999, 1483228869183950502},
        Case{"2017-01-01T00:00:00.000000000Z", 1483228837000000000, 1483228869184000000, 1483228869183950503},
        Case{"2026-11-22T20:00:00.123456789Z", 1795377637123456789, 1795377669307456789, 1795377669306361650},
        Case{"2200-07-04T01:02:03.500000000Z", 7274019760500000000, 7274019792684000000, 7274019792684144138},
    };
    for (const Case& c : cases) {
        INFO(c.utc);
        const Epoch epoch = read_time(c.utc, erfa_leap_seconds());
        CHECK(std::abs(epoch.tai_ns - c.tai_ns) <= 1);
        CHECK(std::abs(count_ns({c.tai_ns}, TimeScale::tt) - c.tt_ns) <= 1);
        CHECK(std::abs(count_ns({c.tai_ns}, TimeScale::tdb) - c.tdb_ns) <= 1);
        CHECK(utc(epoch) == c.utc);
    }
}

TEST_CASE("a reading of any scale is the instant it came from", "[ephemeris]") {
    const LeapSeconds leap_seconds = erfa_leap_seconds();
    // From 1678 to 2261, and the nanoseconds around a leap second.
    std::vector<std::int64_t> instants{first_day * ns_per_day + 60 * ns_per_s, last_day * ns_per_day - 1,
                                       946727967816000000, 0, -1};
    for (std::int64_t i = -3; i < 3; ++i)
        for (const std::int64_t whole_s : {1483228836, 1483228837, 78796811, 63072010, -265680000})
            instants.push_back(whole_s * ns_per_s + i);
    for (std::int64_t i = -300; i < 300; ++i)
        instants.push_back(i * 30'000'000'123'456'789);
    for (const std::int64_t tai_ns : instants)
        for (const TimeScale scale :
             {TimeScale::utc, TimeScale::tai, TimeScale::tt, TimeScale::tdb, TimeScale::gps}) {
            if (scale == TimeScale::utc && tai_ns < first_utc_day * ns_per_day + ns_per_s) continue;
            INFO(tai_ns << " ns, " << name_of(scale));
            const DayTime at = reading({tai_ns}, scale, leap_seconds);
            CHECK(at.ns >= 0);
            CHECK(at.ns < day_length_ns(at.day, scale, leap_seconds));
            CHECK(epoch_of(at, scale, leap_seconds).tai_ns == tai_ns);
            CHECK(read_time(write_time({tai_ns}, scale, TimeForm::iso, leap_seconds), leap_seconds).tai_ns ==
                  tai_ns);
            CHECK(read_time(write_time({tai_ns}, scale, TimeForm::jd, leap_seconds), leap_seconds).tai_ns ==
                  tai_ns);
        }
}

TEST_CASE("UTC before 1960 is refused", "[ephemeris]") {
    CHECK_THROWS_WITH(reading({first_utc_day * ns_per_day}, TimeScale::utc, erfa_leap_seconds()),
                      ContainsSubstring("UTC begins in 1960"));
}

TEST_CASE("a negative leap second takes the last second off its day", "[ephemeris]") {
    LeapSeconds leap_seconds = erfa_leap_seconds();
    const std::int64_t day = day_of({2030, 1, 1});
    leap_seconds.steps.push_back({day, 36});
    const Epoch before = read_time("2029-12-31T23:59:58Z", leap_seconds);
    CHECK(read_time("2030-01-01T00:00:00Z", leap_seconds).tai_ns - before.tai_ns == ns_per_s);
    CHECK(write_time({before.tai_ns + ns_per_s}, TimeScale::utc, TimeForm::iso, leap_seconds, 0) ==
          "2030-01-01T00:00:00Z");
    CHECK_THROWS_WITH(read_time("2029-12-31T23:59:59Z", leap_seconds),
                      ContainsSubstring("character 18: a second that this day does not have"));
}

TEST_CASE("leap seconds are read from IERS lists and from kernels", "[ephemeris]") {
    const LeapSeconds list =
        parse_leap_seconds("#$ 1\n#@ 3991593600\n2272060800 10 # 1 Jan 1972\n2287785600\t11\n", "list");
    CHECK(list.steps == std::vector<LeapSecond>{{730, 10}, {912, 11}});
    CHECK(list.expires_utc_s == 1782604800); // 2026-06-28
    const LeapSeconds kernel =
        parse_leap_seconds("KPL/LSK\nDELTET/DELTA_AT = ( 1, @1900-JAN-1 )\n\\begindata\n"
                           "DELTET/K = 1.657D-3\nDELTET/DELTA_AT = ( 10, @1972-JAN-1\n 11,@1972-JUL-1 )\n"
                           "\\begintext\n12, @1973-JAN-1\n",
                           "kernel");
    CHECK(kernel.steps == list.steps);
    CHECK_FALSE(kernel.expires_utc_s.has_value());
}

TEST_CASE("bad leap second files are refused with file and line", "[ephemeris]") {
    struct Case {
        const char *text, *message;
    };
    for (const Case& c : {
             Case{"", "f: no leap seconds"},
             Case{"2272060800 10\n2287785600\n", "f:2: wanted is"},
             Case{"2272060801 10\n", "f:1: 2272060801 s since 1900 is not the beginning of a UTC day"},
             Case{"2272060800 10\n2287785600 13\n",
                  "f: leap second of 1972-07-01: TAI - UTC goes from 10 s to 13 s"},
             Case{"2272060800 10\n2272060800 11\n", "f: leap second of 1972-01-01 does not come after"},
             Case{"2287785600 11\n", "f: the leap seconds do not begin with 10 s on 1972-01-01"},
             Case{"#@ never\n", "f:1: \"#@\""},
             Case{"\\begindata\nDELTET/DELTA_AT = ( 10, @1972-JAN-1\n 11, @1972-JUL-32 )\n",
                  "f:3: DELTET/DELTA_AT: \"@1972-JUL-32\""},
             Case{"\\begindata\nDELTET/DELTA_AT = ( ten, @1972-JAN-1 )\n", "f:2: DELTET/DELTA_AT: \"ten\""},
             Case{"\\begindata\nX = 1\n", "f: no leap seconds"},
         })
        CHECK_THROWS_WITH(parse_leap_seconds(c.text, "f"), ContainsSubstring(c.message));
    CHECK_THROWS_WITH(read_leap_seconds("/nowhere/x.tls"),
                      ContainsSubstring("/nowhere/x.tls: cannot be read"));
}

TEST_CASE("NAIF's kernel and the system's list agree with ERFA", "[ephemeris]") {
    const LeapSeconds erfa = erfa_leap_seconds();
    CHECK(erfa.steps.size() >= 28);
    CHECK(erfa.steps.front() == LeapSecond{730, 10});
    if (const auto kernel = test::data_file("ephemeris/naif0012.tls"))
        CHECK(read_leap_seconds(*kernel).steps == erfa.steps);
    if (std::filesystem::exists(system_leap_second_file)) {
        const LeapSeconds system = read_leap_seconds(system_leap_second_file);
        CHECK(system.expires_utc_s.has_value());
        CHECK(std::equal(erfa.steps.begin(), erfa.steps.end(), system.steps.begin()));
    } else
        WARN("skipped: no " << system_leap_second_file);
}

} // namespace time_scale_test
