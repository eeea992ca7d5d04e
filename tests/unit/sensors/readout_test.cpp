#include "sensors/sensor.hpp"
#include "tests/support/catch.hpp"

using namespace obscura;
using namespace obscura::sensors;

namespace {

// The HAS2 at 5 MHz: 8 us of row overhead and 200 ns a pixel.
ReadoutSettings has2() {
    ReadoutSettings s;
    s.pixel_clock_hz = 5e6;
    s.row_overhead_ns = 8000;
    s.sample_instant_ns = 2000;
    s.reset_instant_ns = 4000;
    return s;
}

ReadoutPlan planned(const ReadoutSettings& s, std::vector<WindowRequest> windows,
                    Time trigger = {1'000'000}) {
    ReadoutPlan plan;
    REQUIRE(plan_readout(s, windows, trigger, plan) == "");
    return plan;
}

} // namespace

TEST_CASE("HAS2 full frame takes 217.9 ms and a 20x20 window 0.24 ms") {
    const ReadoutPlan full = planned(has2(), {{{0, 0, 1024, 1024}, 66'000'000}});
    CHECK(full.row_ns == 212'800);
    CHECK(full.readout_ns == 217'907'200);
    const ReadoutPlan small = planned(has2(), {{{500, 300, 20, 20}, 100'000}});
    CHECK(small.readout_ns == 240'000);
}

TEST_CASE("a rolling shutter obtains whole row slots less the reset-to-sample time") {
    const ReadoutPlan plan = planned(has2(), {{{0, 0, 1024, 1024}, 310 * 212'800 - 2000}});
    CHECK(plan.windows[0].flags == 0);
    for (std::size_t r = 0; r < 1024; ++r) {
        REQUIRE(plan.rows[r].reset.ns == 1'000'000 + static_cast<std::int64_t>(r) * 212'800);
        REQUIRE(plan.rows[r].exposure_ns() == 310 * 212'800 - 2000);
        REQUIRE(plan.sensor_row[r] == static_cast<std::int32_t>(r));
        REQUIRE(plan.release[r] - plan.rows[r].read == 212'800 - 2000);
    }
    CHECK(plan.frame_period_ns == 1024 * 212'800);
}

TEST_CASE("an exposure between two row slots is rounded up and flagged") {
    const ReadoutPlan plan = planned(has2(), {{{0, 0, 1024, 1024}, 310 * 212'800 - 1999}});
    CHECK(plan.rows[0].exposure_ns() == 311 * 212'800 - 2000);
    CHECK(plan.windows[0].flags == exposure_quantised);
}

TEST_CASE("an exposure below one row slot is clamped up and flagged") {
    const ReadoutPlan plan = planned(has2(), {{{0, 0, 1024, 8}, 1}});
    CHECK(plan.rows[0].exposure_ns() == 212'800 - 2000);
    CHECK((plan.windows[0].flags & exposure_clamped_up) != 0);
}

TEST_CASE("an exposure longer than the readout stretches the frame period") {
    const ReadoutPlan plan = planned(has2(), {{{0, 0, 1024, 4}, 100 * 212'800 - 2000}});
    CHECK(plan.frame_period_ns == 100 * 212'800);
    ReadoutSettings apart = has2();
    apart.overlapped = false;
    CHECK(planned(apart, {{{0, 0, 1024, 4}, 100 * 212'800 - 2000}}).frame_period_ns == 104 * 212'800);
}

TEST_CASE("outputs share the pixels of a row") {
    ReadoutSettings s = has2();
    s.outputs = 3;
    CHECK(planned(s, {{{0, 0, 1024, 8}, 1'000'000}}).row_ns == 8000 + 342 * 200);
}

TEST_CASE("a global shutter exposes all rows together and reads them one by one") {
    ReadoutSettings s = has2();
    s.shutter = Shutter::global;
    s.frame_overhead_ns = 50'000;
    const ReadoutPlan plan = planned(s, {{{0, 16, 1024, 32}, 1'234'567}});
    for (std::size_t r = 0; r < 32; ++r) {
        REQUIRE(plan.rows[r].reset.ns == 1'000'000);
        REQUIRE(plan.rows[r].exposure_ns() == 1'234'567);
        REQUIRE(plan.release[r] - plan.rows[r].read == 50'000 + static_cast<std::int64_t>(r + 1) * 212'800);
    }
    CHECK(plan.windows[0].flags == 0);
    CHECK(plan.frame_period_ns == 50'000 + 32 * 212'800);
}

TEST_CASE("settings that no chip can follow are refused with the reason") {
    ReadoutPlan plan;
    const auto reason = [&](const ReadoutSettings& s, std::vector<WindowRequest> windows) {
        return plan_readout(s, windows, Time{}, plan);
    };
    using Catch::Matchers::ContainsSubstring;
    CHECK_THAT(reason(has2(), {{{0, 0, 1024, 1025}, 1000}}),
               ContainsSubstring("does not lie on the 1024x1024 array"));
    CHECK_THAT(reason(has2(), {{{-1, 0, 10, 10}, 1000}}), ContainsSubstring("window 0"));
    CHECK_THAT(reason(has2(), {{{0, 0, 0, 10}, 1000}}), ContainsSubstring("0x10"));
    CHECK_THAT(reason(has2(), {{{2147483647, 0, 2147483647, 10}, 1000}}), ContainsSubstring("does not lie"));
    CHECK_THAT(reason(has2(), {{{0, 0, 10, 10}, 0}}), ContainsSubstring("exposure"));
    CHECK_THAT(reason(has2(), {{{0, 0, 10, 10}, -5}}), ContainsSubstring("exposure"));
    CHECK_THAT(reason(has2(), {}), ContainsSubstring("0 windows"));
    ReadoutSettings s = has2();
    s.reset_instant_ns = 8000;
    CHECK_THAT(reason(s, {{{0, 0, 10, 10}, 1000}}), ContainsSubstring("row slot"));
    s = has2();
    s.pixel_clock_hz = 0;
    CHECK_THAT(reason(s, {{{0, 0, 10, 10}, 1000}}), ContainsSubstring("pixel clock"));
}
