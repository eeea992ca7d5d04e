// SPDX-License-Identifier: Apache-2.0
#include "sync/schedule.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <stdexcept>

namespace schedule_test {

using namespace obscura;
using obscura::sync::rational_rate;
using obscura::sync::RationalRate;
using obscura::sync::Schedule;

namespace {

__extension__ using Wide = __int128;

// The definition itself, in 128 bits.
std::int64_t slot_by_definition(RationalRate rate, std::uint64_t k) {
    const Wide exact = Wide{static_cast<std::int64_t>(k)} * ns_per_s * rate.denominator;
    return static_cast<std::int64_t>(exact / rate.numerator);
}

} // namespace

TEST_CASE("rates become the fractions people mean") {
    CHECK(rational_rate(10) == RationalRate{10, 1});
    CHECK(rational_rate(0.5) == RationalRate{1, 2});
    CHECK(rational_rate(0.1) == RationalRate{1, 10});
    CHECK(rational_rate(29.97) == RationalRate{2997, 100});
    CHECK(rational_rate(30000.0 / 1001.0) == RationalRate{30000, 1001});
    CHECK(rational_rate(100.0 / 3.0) == RationalRate{100, 3});
    CHECK(rational_rate(1e6) == RationalRate{1'000'000, 1});
    CHECK(rational_rate(1e-6) == RationalRate{1, 1'000'000});
    for (double hz = 1.1e-6; hz < 1e6; hz *= 1.37) {
        const RationalRate rate = rational_rate(hz);
        CHECK(std::abs(rate.hz() - hz) <= 1.0001e-9 * hz);
    }
}

TEST_CASE("rates that make no sense are refused") {
    for (const double hz : {0.0, -1.0, 2e6, std::nan(""), HUGE_VAL})
        CHECK_THROWS_AS(rational_rate(hz), std::invalid_argument);
}

TEST_CASE("a slot is where its number says, to the nanosecond, for a thousand hours") {
    const double rates[] = {10, 1, 0.1, 29.97, 30000.0 / 1001, 100.0 / 3, 7, 59.94, 999.983, 1e6 / 7};
    for (const double hz : rates) {
        const RationalRate rate = rational_rate(hz);
        const Schedule schedule(rate, Time{123'456'789}, 42);
        const auto last = static_cast<std::uint64_t>(3.6e6 * hz);
        for (const std::uint64_t k : {std::uint64_t{0}, std::uint64_t{1}, std::uint64_t{2},
                                      std::uint64_t{1000}, last / 3, last - 1, last})
            CHECK(schedule.slot(k).ns == 123'456'789 + 42 + slot_by_definition(rate, k));
        // After exactly `numerator` slots, `denominator` whole seconds have passed.
        CHECK(schedule.slot(static_cast<std::uint64_t>(rate.numerator)) - schedule.slot(0) ==
              rate.denominator * ns_per_s);
    }
}

TEST_CASE("the first slot from an instant") {
    const Schedule schedule(RationalRate{3, 1}, Time{1000}, 0);
    CHECK(schedule.first_slot_from(Time{0}) == 0);
    CHECK(schedule.first_slot_from(Time{1000}) == 0);
    CHECK(schedule.first_slot_from(Time{1001}) == 1);
    CHECK(schedule.first_slot_from(schedule.slot(1)) == 1);
    CHECK(schedule.first_slot_from(schedule.slot(1) + 1) == 2);
    for (std::uint64_t k = 1; k < 4'000'000'000; k = k * 3 + 1) {
        CHECK(schedule.first_slot_from(schedule.slot(k)) == k);
        CHECK(schedule.first_slot_from(schedule.slot(k) + 1) == k + 1);
        CHECK(schedule.first_slot_from(schedule.slot(k) - 1) == k);
    }
}

} // namespace schedule_test
