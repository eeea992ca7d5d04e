// SPDX-License-Identifier: Apache-2.0
// TAI and TDB instants against python3-erfa.
#include "ephemeris/time/epoch.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>

namespace epoch_test {

using namespace obscura::ephemeris;

TEST_CASE("TDB of instants agrees with python3-erfa to a nanosecond") {
    struct Case {
        std::int64_t tai_ns;
        double whole_s, part_s;
    };
    // erfa.dtdb() of python3-erfa 2.0.0.1, sums in Python's decimal numbers.
    constexpr std::array cases{
        Case{946727967816000000, -1.0, 0.999900692801},
        Case{0, -946727968.0, 0.183948398707},
        Case{1700000000123456789, 753272032.0, 0.306171764313},
        Case{-31535999999999995, -978263968.0, 0.183958079315},
        Case{2400000000999999999, 1453272033.0, 0.184432566224},
        Case{1172707200500000000, 225979232.0, 0.685391284534},
    };
    for (const Case& c : cases) {
        const TdbTime tdb = to_tdb({c.tai_ns});
        CHECK(tdb.whole_s == c.whole_s);
        CHECK(std::abs(tdb.part_s - c.part_s) < 1e-9);
        CHECK(to_epoch(tdb).tai_ns == c.tai_ns);
    }
}

TEST_CASE("A span is added to a TDB time without loss of its fraction") {
    const TdbTime t = TdbTime{8e8, 0.75} + 1e9;
    CHECK(t.whole_s == 1.8e9);
    CHECK(t.part_s == 0.75);
    const TdbTime back = t + -0.875;
    CHECK(back.whole_s == 1.8e9 - 1);
    CHECK(back.part_s == 0.875);
}

} // namespace epoch_test
