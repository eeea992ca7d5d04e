// SPDX-License-Identifier: Apache-2.0
#include "core/clock.hpp"
#include "tests/support/catch.hpp"

#include <thread>

namespace clock_test {

using namespace obscura;

TEST_CASE("midpoint of two instants does not overflow") {
    constexpr Time far{std::int64_t{1} << 62};
    CHECK(midpoint(far, far + 10) == far + 5);
}

TEST_CASE("the monotonic clock sleeps to its deadline and not less") {
    MonotonicClock clock;
    const Time deadline = clock.now() + 2 * ns_per_ms;
    CHECK(clock.sleep_until(deadline));
    CHECK(clock.now() >= deadline);
    CHECK(clock.sleep_until(deadline - ns_per_s)); // in the past: at once
}

TEST_CASE("an interrupt ends a sleep and keeps the next from starting") {
    MonotonicClock clock;
    std::thread sleeper([&] { CHECK_FALSE(clock.sleep_until(clock.now() + 3600 * ns_per_s)); });
    clock.interrupt();
    sleeper.join();
    CHECK_FALSE(clock.sleep_until(clock.now() + 3600 * ns_per_s));
    clock.rearm();
    CHECK(clock.sleep_until(clock.now()));
}

TEST_CASE("the TAI offset maps monotonic time to within a second of UTC plus 0 or 37 s") {
    const MonotonicClock clock;
    timespec wall{};
    clock_gettime(CLOCK_REALTIME, &wall);
    const std::int64_t tai_ns = clock.now().ns + clock.tai_offset_ns();
    const double difference_s = to_seconds(tai_ns) - static_cast<double>(wall.tv_sec);
    CHECK(difference_s > -1.0);
    CHECK(difference_s < 60.0);
}

TEST_CASE("the fake clock stands still until it is moved") {
    FakeClock clock(Time{100});
    bool reached = false;
    std::thread sleeper([&] { reached = clock.sleep_until(Time{200}); });
    while (clock.sleepers() == 0)
        std::this_thread::yield();
    clock.advance_to(Time{199});
    CHECK(clock.sleepers() == 1);
    clock.advance(1);
    sleeper.join();
    CHECK(reached);
    CHECK(clock.now() == Time{200});
    clock.advance_to(Time{50}); // never back
    CHECK(clock.now() == Time{200});
}

TEST_CASE("in auto-advance mode a sleep is a jump") {
    FakeClock clock(Time{}, true);
    CHECK(clock.sleep_until(Time{3600 * ns_per_s}));
    CHECK(clock.now() == Time{3600 * ns_per_s});
    clock.set_tai_offset_ns(37 * ns_per_s);
    CHECK(clock.tai_offset_ns() == 37 * ns_per_s);
    clock.interrupt();
    CHECK_FALSE(clock.sleep_until(Time{7200 * ns_per_s}));
    CHECK(clock.now() == Time{3600 * ns_per_s});
}

} // namespace clock_test
