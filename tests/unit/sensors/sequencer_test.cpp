// SPDX-License-Identifier: Apache-2.0
#include "has2.hpp"
#include "sensors/readout/sequencer.hpp"
#include "tests/support/catch.hpp"

namespace sequencer_test {

using namespace obscura;
using namespace obscura::sensors;
using test::has2;

namespace {

constexpr std::int64_t row_ns = 212'800;

} // namespace

TEST_CASE("a trigger during the readout waits for the row grid, one before that is an over-trigger") {
    ReadoutSequencer sequencer;
    ReadoutPlan plan;
    const WindowRequest window{{0, 0, 1024, 100}, 150 * row_ns - 2000};
    REQUIRE(sequencer.next(has2(), {&window, 1}, Time{0}, plan) == TriggerVerdict::accepted);
    CHECK(plan.trigger.ns == 0);
    CHECK(plan.frame_period_ns == 150 * row_ns);

    CHECK(sequencer.next(has2(), {&window, 1}, Time{150 * row_ns - 1}, plan) == TriggerVerdict::over_trigger);
    CHECK(sequencer.over_triggers() == 1);

    // The rows of the first frame are read from 150 to 250 slots: in between the start is on the grid.
    REQUIRE(sequencer.next(has2(), {&window, 1}, Time{200 * row_ns + 1}, plan) == TriggerVerdict::accepted);
    CHECK(plan.trigger.ns == 201 * row_ns);
    CHECK((plan.windows[0].flags & trigger_deferred) != 0);
    CHECK(plan.rows[0].exposure_ns() == window.exposure_ns);
    // The frame period counts from there, not from the trigger.
    CHECK(sequencer.next(has2(), {&window, 1}, Time{351 * row_ns - 1}, plan) == TriggerVerdict::over_trigger);

    // After the last row the chip is idle and starts at once.
    const Time late{(201 + 300) * row_ns + 77};
    REQUIRE(sequencer.next(has2(), {&window, 1}, late, plan) == TriggerVerdict::accepted);
    CHECK(plan.trigger == late);
    CHECK((plan.windows[0].flags & trigger_deferred) == 0);
    CHECK(sequencer.accepted() == 3);
}

TEST_CASE("without overlap the next exposure waits for the last row") {
    ReadoutSettings s = has2();
    s.overlapped = false;
    ReadoutSequencer sequencer;
    ReadoutPlan plan;
    const WindowRequest window{{0, 0, 1024, 100}, 150 * row_ns - 2000};
    REQUIRE(sequencer.next(s, {&window, 1}, Time{0}, plan) == TriggerVerdict::accepted);
    CHECK(sequencer.next(s, {&window, 1}, Time{250 * row_ns - 1}, plan) == TriggerVerdict::over_trigger);
    CHECK(sequencer.next(s, {&window, 1}, Time{250 * row_ns}, plan) == TriggerVerdict::accepted);
}

TEST_CASE("a global shutter exposes during readout, from a row's start on") {
    ReadoutSettings s = has2();
    s.shutter = Shutter::global;
    s.frame_overhead_ns = 1000;
    ReadoutSequencer sequencer;
    ReadoutPlan plan;
    const WindowRequest window{{0, 0, 1024, 100}, 1'000'000};
    REQUIRE(sequencer.next(s, {&window, 1}, Time{0}, plan) == TriggerVerdict::accepted);
    CHECK(plan.frame_period_ns == 1000 + 100 * row_ns);
    REQUIRE(sequencer.next(s, {&window, 1}, Time{1000 + 100 * row_ns + 5}, plan) == TriggerVerdict::accepted);
    // The readout runs from 1,001,000 on: the 96th row start behind the trigger.
    CHECK((plan.trigger.ns - 1'001'000) % row_ns == 0);
    CHECK(plan.trigger.ns - (1000 + 100 * row_ns + 5) < row_ns);
    CHECK((plan.windows[0].flags & trigger_deferred) != 0);
}

TEST_CASE("interleaved windows start at the sequencer's cycles") {
    ReadoutSettings s = has2();
    s.window_mode = WindowMode::interleaved;
    s.blanking_rows = 5;
    ReadoutSequencer sequencer;
    ReadoutPlan plan;
    const std::vector<WindowRequest> windows{{{0, 0, 20, 20}, 100'000}, {{0, 100, 20, 20}, 300'000}};
    REQUIRE(sequencer.next(s, windows, Time{0}, plan) == TriggerVerdict::accepted);
    const std::int64_t cycle = plan.cycle_ns;
    REQUIRE(sequencer.next(s, windows, Time{cycle}, plan) == TriggerVerdict::accepted);
    CHECK(plan.trigger.ns == cycle);
    REQUIRE(sequencer.next(s, windows, Time{2 * cycle + 1}, plan) == TriggerVerdict::accepted);
    CHECK(plan.trigger.ns == 3 * cycle);
}

TEST_CASE("the first frame after a change keeps the starts of the old one, and says so") {
    ReadoutSettings s = has2();
    s.stretch_blanking = false;
    ReadoutSequencer sequencer;
    ReadoutPlan plan;
    const std::int64_t forever = ns_per_s;
    const WindowRequest before{{0, 0, 1024, 100}, forever};
    REQUIRE(sequencer.next(s, {&before, 1}, Time{0}, plan) == TriggerVerdict::accepted);
    const Time read_of_row_50 = plan.rows[50].read;
    const Time next = Time{plan.frame_period_ns};
    // Rows 50 to 149: 50 to 99 were started by the reads of the old frame.
    const WindowRequest after{{0, 50, 1024, 100}, forever};
    REQUIRE(sequencer.next(s, {&after, 1}, next, plan) == TriggerVerdict::accepted);
    CHECK(plan.rows[0].reset - read_of_row_50 == 2000);
    CHECK((plan.windows[0].flags & settings_changed) != 0);
    CHECK(plan.windows[0].exposure_min_ns < plan.windows[0].exposure_max_ns);

    // Once the change has gone through, nothing is dirty any more.
    REQUIRE(sequencer.next(s, {&after, 1}, plan.trigger + plan.frame_period_ns, plan) ==
            TriggerVerdict::accepted);
    CHECK((plan.windows[0].flags & settings_changed) == 0);
    CHECK(plan.windows[0].exposure_min_ns == plan.windows[0].exposure_max_ns);
}

TEST_CASE("impossible settings leave the sequencer as it was") {
    ReadoutSequencer sequencer;
    ReadoutPlan plan;
    const WindowRequest bad{{0, 0, 2000, 100}, 1'000'000};
    CHECK(sequencer.next(has2(), {&bad, 1}, Time{0}, plan) == TriggerVerdict::refused);
    CHECK(!sequencer.reason().empty());
    CHECK(sequencer.accepted() == 0);
}

} // namespace sequencer_test
