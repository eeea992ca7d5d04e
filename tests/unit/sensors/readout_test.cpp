// SPDX-License-Identifier: Apache-2.0
#include "has2.hpp"
#include "sensors/sensor.hpp"
#include "tests/support/catch.hpp"

namespace readout_test {

using namespace obscura;
using namespace obscura::sensors;
using test::has2;

namespace {

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
    // All windows have the exposure of the first; what each asked for is kept.
    const ReadoutPlan two = planned(s, {{{0, 0, 1024, 16}, 2'000'000}, {{0, 512, 1024, 16}, 1'000'000}});
    CHECK(two.windows[1].exposure_requested_ns == 1'000'000);
    CHECK(two.windows[1].exposure_max_ns == 2'000'000);
    CHECK((two.windows[1].flags & exposure_clamped_up) != 0);
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
    CHECK_THAT(reason(has2(), {{{0, 0, 10, 10}, 0}}), ContainsSubstring("ExposureTime"));
    CHECK_THAT(reason(has2(), {{{0, 0, 10, 10}, -5}}), ContainsSubstring("ExposureTime"));
    CHECK_THAT(reason(has2(), {}), ContainsSubstring("0 requested"));
    ReadoutSettings s = has2();
    s.reset_instant_ns = 8000;
    CHECK_THAT(reason(s, {{{0, 0, 10, 10}, 1000}}), ContainsSubstring("reset_instant_ns"));
    s = has2();
    s.pixel_clock_hz = 0;
    CHECK_THAT(reason(s, {{{0, 0, 10, 10}, 1000}}), ContainsSubstring("pixel_clock_hz"));
}

TEST_CASE("windows of an interleaved sequencer get their own exposures, up to one row slot longer") {
    // The set-up and the figures of an independent script: 102-114, 15,002-15,026 and 502-566 us.
    ReadoutSettings s = has2();
    s.window_mode = WindowMode::interleaved;
    const ReadoutPlan plan = planned(
        s, {{{0, 10, 20, 20}, 100'000}, {{0, 200, 300, 300}, 15'000'000}, {{0, 700, 40, 40}, 500'000}});
    REQUIRE(plan.windows.size() == 3);
    CHECK(plan.cycle_ns == 20 * 12'000 + 300 * 68'000 + 40 * 16'000);
    CHECK(plan.windows[0].exposure_min_ns == 102'000);
    CHECK(plan.windows[0].exposure_max_ns == 114'000);
    CHECK(plan.windows[1].exposure_min_ns == 15'002'000);
    CHECK(plan.windows[1].exposure_max_ns == 15'026'000);
    CHECK(plan.windows[2].exposure_min_ns == 502'000);
    CHECK(plan.windows[2].exposure_max_ns == 566'000);
    for (const FrameWindow& w : plan.windows)
        CHECK(w.flags == exposure_quantised);
}

TEST_CASE("a destructive window cuts the integration of another one on the rows they share") {
    ReadoutSettings s = has2();
    s.window_mode = WindowMode::interleaved;
    const ReadoutPlan plan = planned(s, {{{0, 100, 20, 20}, 50'000}, {{0, 110, 300, 300}, 15'000'000}});
    CHECK(plan.rows[20 + 5].exposure_ns() == 398'000); // row 115
    CHECK((plan.windows[1].flags & row_shared) != 0);
    CHECK((plan.windows[0].flags & row_shared) == 0);
    CHECK(plan.rows[20 + 190].exposure_ns() >= 15'000'000); // row 300 is its own
}

TEST_CASE("an exposure beyond the cycle is clamped where the cycle may not be stretched") {
    ReadoutSettings s = has2();
    s.stretch_blanking = false;
    const ReadoutPlan plan = planned(s, {{{0, 0, 1024, 1024}, 1'000'000'000'000}});
    CHECK(plan.rows[17].exposure_ns() == 1024 * 212'800 - 2000);
    CHECK((plan.windows[0].flags & exposure_clamped_down) != 0);
}

TEST_CASE("non-destructive reads follow each other at the cycle") {
    ReadoutSettings s = has2();
    const WindowRequest raw{{0, 0, 1024, 8}, 30'000'000, Sampling::non_destructive, 4};
    const ReadoutPlan plan = planned(s, {raw});
    REQUIRE(plan.windows.size() == 4);
    CHECK(plan.windows[0].read_spacing_ns >= 10'000'000);
    for (std::size_t k = 0; k < 4; ++k) {
        CHECK(plan.windows[k].read_index == static_cast<std::int32_t>(k));
        CHECK(plan.rows[8 * k].reset == plan.rows[0].reset);
        CHECK(plan.rows[8 * k].read - plan.rows[0].read ==
              static_cast<std::int64_t>(k) * plan.windows[0].read_spacing_ns);
    }
    const WindowRequest cds{{0, 0, 1024, 8}, 30'000'000, Sampling::cds, 2};
    const ReadoutPlan difference = planned(s, {cds});
    REQUIRE(difference.windows.size() == 1);
    CHECK(difference.rows[3].exposure_ns() == difference.cycle_ns);
    CHECK(difference.rows[3].exposure_ns() >= 30'000'000);
    CHECK(difference.rows[3].exposure_ns() < 30'000'000 + 212'800);
}

TEST_CASE("sequential windows never overlap") {
    ReadoutSettings s = has2();
    s.window_overhead_ns = 5000;
    const ReadoutPlan plan = planned(s, {{{0, 0, 20, 20}, 99'000}, {{0, 10, 1024, 30}, 1'000'000}});
    CHECK(plan.rows[20].reset > plan.rows[19].read);
    CHECK(plan.rows[20].reset - plan.release[19] == 5000 + 4000);
    CHECK((plan.windows[0].flags & row_shared) == 0);
    CHECK((plan.windows[1].flags & row_shared) == 0);
    // Each occupies its exposure and its rows in whole slots.
    CHECK(plan.frame_period_ns == (9 + 20) * 12'000 + (5 + 30) * 212'800 + 2 * 5000);
}

TEST_CASE("push-broom reads one row at the line rate") {
    ReadoutSettings s = has2();
    s.shutter = Shutter::push_broom;
    s.line_rate_hz = 1000;
    const ReadoutPlan plan = planned(s, {{{0, 500, 1024, 3000}, 400'000}});
    REQUIRE(plan.rows.size() == 3000);
    CHECK(plan.sensor_row[2999] == 500);
    CHECK(plan.rows[2999].reset.ns == 1'000'000 + 2999 * ns_per_ms);
    CHECK(plan.rows[2999].exposure_ns() == 400'000);
    CHECK(plan.frame_period_ns == 3000 * ns_per_ms);
    const ReadoutPlan longer = planned(s, {{{0, 500, 1024, 4}, 4'000'000}});
    CHECK(longer.rows[0].exposure_ns() == 998'000);
    CHECK(longer.windows[0].flags == (exposure_clamped_down | exposure_quantised));
}

TEST_CASE("a lenient chip crops and aligns windows, and says so") {
    ReadoutSettings s = has2();
    s.window_step = 2;
    ReadoutPlan plan;
    const WindowRequest odd{{3, 1001, 100, 100}, 1'000'000};
    CHECK_THAT(plan_readout(s, {&odd, 1}, Time{}, plan),
               Catch::Matchers::ContainsSubstring("multiples of 2"));
    s.strict = false;
    REQUIRE(plan_readout(s, {&odd, 1}, Time{}, plan) == "");
    CHECK(plan.windows[0].sensor == Region{2, 1000, 101, 24});
    CHECK((plan.windows[0].flags & window_cropped) != 0);
    const WindowRequest outside{{1024, 0, 10, 10}, 1'000'000};
    CHECK_THAT(plan_readout(s, {&outside, 1}, Time{}, plan),
               Catch::Matchers::ContainsSubstring("nothing of it lies"));
}

TEST_CASE("flags have names") {
    CHECK(flag_names(0).empty());
    CHECK(flag_names(row_shared | exposure_quantised) == "ROW_SHARED|T_QUANTISED");
}

} // namespace readout_test
