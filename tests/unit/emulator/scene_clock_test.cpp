// SPDX-License-Identifier: Apache-2.0
// The scene time that frames show, by each of the scene's clocks.
#include "core/error.hpp"
#include "emulator/camera/scene_clock.hpp"
#include "ephemeris/time/time_text.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <string>
#include <vector>

namespace scene_clock_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Scene time that frame `id` shows at its edge, and `later_ns` after it.
std::int64_t shown_ns(const SceneClock& clock, const SceneClock::Edge& edge, std::int64_t later_ns = 0) {
    const SceneClock::Instant instant = clock.at(edge);
    return instant.shown.at(instant.planned + later_ns).ns;
}

} // namespace

TEST_CASE("nominal and running scene time start and run as they are told") {
    SceneClock nominal({.mode = SceneTime::nominal, .start_ns = 5'000, .rate = 2});
    CHECK(shown_ns(nominal, {.frame_id = 3, .nominal = Time{200}, .edge = Time{987}}) == 5'400);
    CHECK(shown_ns(nominal, {.frame_id = 3, .nominal = Time{200}, .edge = Time{987}}, 50) == 5'500);
    CHECK(nominal.at({.frame_id = 3, .nominal = Time{200}}).planned == Time{200});

    SceneClock running({.mode = SceneTime::clock, .start_ns = -7, .rate = 0.5});
    running.begin(Time{1'000'000});
    CHECK(shown_ns(running, {.frame_id = 9, .nominal = Time{200}, .edge = Time{1'000'100}}) == 43);
    CHECK(running.at({.edge = Time{1'000'100}}).planned == Time{100});

    // Thirty years at an odd rate are exact to the nanosecond: 946'080'000 s * 1.25 = 1'182'600'000 s.
    const SceneClock years({.mode = SceneTime::nominal, .rate = 1.25});
    CHECK(shown_ns(years, {.nominal = Time{946'080'000'000'000'004}}) == 1'182'600'000'000'000'005);
}

TEST_CASE("a scene that follows TAI shows the sky of each edge, also across a leap second") {
    const auto leap_seconds = ephemeris::erfa_leap_seconds();
    const auto tai_ns = [&](const char* utc) { return ephemeris::read_time(utc, leap_seconds).tai_ns; };
    const SceneClock clock({.mode = SceneTime::tai, .epoch = {tai_ns("2016-12-31T23:59:50Z")}});
    // The scheduling clock began some time before; its distance to TAI does not change at a leap second.
    const std::int64_t offset_ns = tai_ns("2016-12-01T00:00:00Z") + 123;
    const auto scene_ns = [&](const char* utc) {
        return shown_ns(clock, {.frame_id = 1,
                                .nominal = Time{77},
                                .edge = Time{tai_ns(utc) - offset_ns},
                                .tai_offset_ns = offset_ns});
    };
    CHECK(scene_ns("2016-12-31T23:59:50Z") == 0);
    CHECK(scene_ns("2016-12-31T23:59:59.5Z") == 9'500'000'000);
    CHECK(scene_ns("2016-12-31T23:59:60.5Z") == 10'500'000'000);
    CHECK(scene_ns("2017-01-01T00:00:00.5Z") == 11'500'000'000);
    CHECK(scene_ns("2016-12-31T23:59:49.999999999Z") == -1);
    CHECK(shown_ns(SceneClock({.mode = SceneTime::tai, .start_ns = 400, .epoch = {50}}),
                   {.edge = Time{60}, .tai_offset_ns = 3}, 8) == 421);
}

TEST_CASE("a replay shows its recorded times, and the last one after them") {
    const SceneClock clock({.mode = SceneTime::replay, .times = {Time{500}, Time{100}, Time{-3}}});
    for (const auto& [id, at] : std::vector<std::pair<std::uint64_t, std::int64_t>>{
             {1, 500}, {2, 100}, {3, -3}, {4, -3}, {1'000'000, -3}}) {
        const Time nominal{static_cast<std::int64_t>(id) * 1000};
        CHECK(shown_ns(clock, {.frame_id = id, .nominal = nominal, .edge = Time{55}}) == at);
        CHECK(shown_ns(clock, {.frame_id = id, .nominal = nominal}, 20) == at + 20);
        CHECK(clock.at({.frame_id = id, .nominal = nominal}).planned == nominal);
    }
}

TEST_CASE("a simulator's time is that of its frame, whatever the scene's clock") {
    for (const SceneTime mode : {SceneTime::nominal, SceneTime::clock, SceneTime::tai}) {
        const SceneClock clock({.mode = mode, .start_ns = 9, .rate = 3});
        CHECK(shown_ns(clock, {.nominal = Time{1}, .edge = Time{2}, .given = Time{4711}}, 6) == 4717);
    }
}

TEST_CASE("the maker renders rows at the scene times that are shown and leaves their readout alone") {
    MakerBench bench;
    FrameOrder order;
    order.frame_id = 2;
    order.scene_time = Time{100 * ns_per_ms};
    order.trigger_edge = Time{9'000'000'000};
    order.settings = whole_sensor(bench.sensor);
    const FrameRef plain = bench.pool.acquire();
    REQUIRE(bench.maker.make(order, *plain).empty());
    order.shown = {order.scene_time, Time{70'000'000'000}, 3};
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bench.maker.make(order, *frame).empty());

    const sensors::ReadoutPlan& plan = bench.maker.plan();
    std::vector<float> light(40);
    std::vector<std::uint16_t> row(40);
    for (std::int32_t y = 0; y < 30; ++y) {
        const auto at = static_cast<std::size_t>(y);
        CHECK(frame->row_times()[at].read == plain->row_times()[at].read);
        const auto scene = [&](Time t) { return Time{70'000'000'000 + 3 * (t - Time{100 * ns_per_ms})}; };
        const Time mid = midpoint(scene(plan.rows[at].reset), scene(plan.rows[at].read));
        for (std::int32_t x = 0; x < 40; ++x)
            light[static_cast<std::size_t>(x)] = test_irradiance(x, y, mid.ns, 2);
        bench.detector.expose(plan, {y, 1, 40, light}, 2, 0, row);
        CHECK(std::equal(row.begin(), row.end(), frame->row(y).begin()));
    }
    CHECK_FALSE(std::equal(plain->pixels().begin(), plain->pixels().end(), frame->pixels().begin()));
    const Time mid = midpoint(plan.rows.front().reset, plan.rows.back().read);
    CHECK(frame->info.truth.camera.position_m.x ==
          to_seconds(70'000'000'000 + 3 * (mid - Time{100 * ns_per_ms})));
    CHECK(frame->info.truth.mid_exposure == plain->info.truth.mid_exposure);
}

TEST_CASE("a camera that follows TAI shows each frame at its own edge") {
    const MonotonicClock now;
    const std::int64_t epoch_ns = now.now().ns + now.tai_offset_ns() - 1000 * ns_per_s;
    CameraBench bench(small_sensor(), 5, {}, sync::OverTrigger::count, LatePolicy::late, false,
                      {.mode = SceneTime::tai, .epoch = {epoch_ns}});
    REQUIRE(bench.camera.acquisition_start());
    for (std::uint64_t id = 1; id <= 3; ++id) {
        bench.wait_ready();
        const Time edge = bench.clock.now();
        bench.camera.on_trigger({id, edge, edge});
        bench.wait_ended(static_cast<std::uint32_t>(id));
    }
    bench.camera.acquisition_stop(false);
    bench.releaser.wait_idle();
    bench.loopback.stop();
    for (const FrameRef& frame : bench.loopback.kept()) {
        // The test renderer's camera is at x = scene time, s, at mid-exposure.
        const std::int64_t since_epoch_ns =
            frame->info.truth.mid_exposure.ns + frame->info.tai_offset_ns - epoch_ns;
        CHECK(since_epoch_ns > 999 * ns_per_s);
        CHECK_THAT(frame->info.truth.camera.position_m.x,
                   Catch::Matchers::WithinAbs(to_seconds(since_epoch_ns), 1e-9));
    }
    CHECK(bench.loopback.kept().size() == 3);
}

TEST_CASE("recorded scene times are read from a table") {
    const TempFolder folder;
    CHECK(read_scene_times(folder.write("t.csv", "time_s\n0.5\n# noted\n0.100000001\n-2\n")) ==
          std::vector<Time>{Time{500'000'000}, Time{100'000'001}, Time{-2'000'000'000}});
    CHECK_THROWS_WITH(
        read_scene_times(folder.write("t.csv", "time_s\n1e10\n")),
        ContainsSubstring("t.csv:2:1: time_s: 10000000000 is out of range, allowed -1e9 to 1e9"));
    CHECK_THROWS_WITH(read_scene_times(folder.write("t.csv", "time_s\n")),
                      ContainsSubstring("t.csv: no rows after the header"));
}

} // namespace scene_clock_test
