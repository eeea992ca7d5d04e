// SPDX-License-Identifier: Apache-2.0
// TriggerRouter: levels, ExposureMode TriggerWidth, ends of counters and timers.
#include "tests/unit/emulator/router_fixture.hpp"

namespace trigger_router_events_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

TEST_CASE("while a level holds, frames are requested at the frame period", "[emulator]") {
    const bool low = GENERATE(false, true);
    CAPTURE(low);
    RouterFixture f([&](CameraSettings& s) {
        s.frame_trigger = {true, TriggerSource::line2,
                           low ? TriggerActivation::level_low : TriggerActivation::level_high};
    });
    f.edge(2, 0, !low); // does not hold yet
    f.start();
    f.run_to(9);
    CHECK(f.frames().empty());
    f.edge(2, 10, low);
    f.edge(2, 22, !low);
    f.run_to(40);
    CHECK(f.frames() == Instants{10, 15, 20});
    f.edge(2, 50, low);
    f.run_to(52);
    f.router.acquisition_stop(true);
    f.run_to(60);
    f.start(); // holds already
    f.run_to(68);
    CHECK(f.frames() == Instants{10, 15, 20, 50, 60, 65});
    f.apply([](CameraSettings& s) { s.frame_trigger = {.enabled = true}; });
    f.run_to(80);
    CHECK(f.requests.size() == 6);
    CHECK(f.counters().missed == 0);
}

TEST_CASE("a level waits for AcquisitionStart and for FrameBurstStart", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.frame_trigger = {true, TriggerSource::line2, TriggerActivation::level_high};
        s.start_trigger = {true, TriggerSource::line0, TriggerActivation::rising_edge};
        s.burst_trigger = {true, TriggerSource::line1, TriggerActivation::rising_edge};
        s.burst_frame_count = 2;
    });
    f.edge(2, 0);
    f.start();
    f.edge(1, 5); // AcquisitionStart first
    f.edge(0, 10);
    f.run_to(19);
    CHECK(f.frames().empty());
    f.edge(1, 20);
    f.run_to(39);
    f.edge(1, 40);
    f.run_to(60);
    CHECK(f.frames() == Instants{20, 25, 40, 45});
}

TEST_CASE("TriggerWidth requests the frame at the pulse's end, with its beginning and width", "[emulator]") {
    const bool by_exposure_start = GENERATE(false, true);
    CAPTURE(by_exposure_start);
    RouterFixture f([&](CameraSettings& s) {
        s.exposure_mode = ExposureMode::trigger_width;
        const TriggerChoice pulse{true, TriggerSource::line2, TriggerActivation::falling_edge};
        (by_exposure_start ? s.exposure_trigger : s.frame_trigger) = pulse;
        s.frame_trigger.enabled = !by_exposure_start;
    });
    f.start();
    f.edge(2, 1); // ends no pulse
    f.edge(2, 10, true);
    CHECK(f.requests.empty());
    f.edge(0, 12);
    f.edge(2, 17);
    f.edge(2, 20, true);
    f.edge(2, 22);
    REQUIRE(f.frames() == Instants{10, 20});
    CHECK(f.requests[0].width_ns == 7 * ms);
    CHECK(f.requests[0].seen == f.at(17));
    CHECK(f.requests[1].width_ns == 2 * ms);
    // A new acquisition forgets the pulse, and so does another source in between.
    f.edge(2, 30, true);
    f.router.acquisition_stop(true);
    f.start();
    f.edge(2, 32);
    f.edge(2, 40, true);
    CameraSettings other = f.settings;
    (by_exposure_start ? other.exposure_trigger : other.frame_trigger).source = TriggerSource::line0;
    f.router.set(other);
    f.router.select(other);
    f.router.set(f.settings);
    f.router.select(f.settings);
    f.edge(2, 42);
    CHECK(f.requests.size() == 2);
    CHECK(f.counters().missed == 0);
}

TEST_CASE("TriggerWidth is timed for single-edge inputs and for any edge", "[emulator]") {
    const TriggerChoice choice =
        GENERATE(TriggerChoice{true, TriggerSource::line1, TriggerActivation::rising_edge},
                 TriggerChoice{true, TriggerSource::line2, TriggerActivation::any_edge});
    RouterFixture f([&](CameraSettings& s) {
        s.exposure_mode = ExposureMode::trigger_width;
        s.frame_trigger = choice;
    });
    f.start();
    f.edge(line_of(choice.source), 5);
    REQUIRE(f.frames() == Instants{5});
    CHECK(f.requests[0].width_ns == 0);
}

TEST_CASE("the end of a counter is an edge at its last event", "[emulator]") {
    const CounterReset reset = GENERATE(CounterReset::off, CounterReset::counter_end);
    CAPTURE(static_cast<int>(reset));
    RouterFixture f([&](CameraSettings& s) {
        s.counters[1] = {IoEvent::line1, reset, 3};
        s.frame_trigger.source = TriggerSource::counter1_end;
    });
    f.edge(1, 1); // counted before the acquisition, too
    f.start();
    f.router.reset_counter(1);
    for (std::int64_t t = 2; t <= 7; ++t)
        f.edge(1, t);
    CHECK(f.frames() == (reset == CounterReset::off ? Instants{4} : Instants{4, 7}));
    f.router.reset_counter(1);
    for (std::int64_t t = 8; t <= 10; ++t)
        f.edge(1, t);
    CHECK(f.frames().back() == 10);
    CHECK(f.counters().missed == 0);
    CHECK(f.counters().lost == 0);
}

TEST_CASE("a late scan finds every end of a counter", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.counters[0] = {IoEvent::line1, CounterReset::counter_end, 2};
        s.frame_trigger.source = TriggerSource::counter0_end;
    });
    f.start();
    f.clock.advance_to(f.at(4));
    for (std::uint64_t id = 1; id <= 4; ++id)
        f.router.line(1).on_trigger({id, f.at(static_cast<std::int64_t>(id)), f.clock.now()});
    f.run_to(4);
    CHECK(f.frames() == Instants{4});
    CHECK(f.counters().edges == 2);
    CHECK(f.counters().missed == 1); // the two coincide
}

TEST_CASE("the end of a counter of missed triggers is no edge", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.counters[0] = {IoEvent::frame_trigger_missed, CounterReset::counter_end, 1};
        s.frame_trigger.source = TriggerSource::counter0_end;
        s.burst_trigger = {true, TriggerSource::software, TriggerActivation::rising_edge};
    });
    f.start();
    CHECK(f.router.software_burst_start(f.at(0)));
    CHECK_FALSE(f.router.software_burst_start(f.at(0)));
    f.run_to(10);
    CHECK(f.counters().missed == 1);
    CHECK(f.requests.empty());
}

TEST_CASE("the end of a timer is an edge at its exact instant", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.timers[0] = {IoEvent::line1, 10 * ms, 40 * ms};
        s.frame_trigger.source = TriggerSource::timer0_end;
    });
    f.edge(1, 1);
    f.run_to(99); // ends while not acquiring
    f.start();
    f.edge(1, 100);
    f.run_to(160);
    CHECK(f.frames() == Instants{150});
    f.edge(1, 200);
    f.edge(1, 220); // starts anew
    f.run_to(300);
    CHECK(f.frames() == Instants{150, 270});
    f.edge(1, 310);
    f.run_to(320);
    f.router.reset_timer(0);
    f.run_to(400);
    f.edge(1, 410);
    f.apply([](CameraSettings& s) { s.timers[0].duration_ns = 5 * ms; }); // earlier starts are ignored
    f.run_to(500);
    CHECK(f.requests.size() == 2);
    f.edge(1, 510);
    f.run_to(530);
    CHECK(f.frames().back() == 525);
}

TEST_CASE("timers and counters follow the instants of the current frame", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.timers[1] = {IoEvent::exposure_end, 0, 10 * ms};
        s.counters[0] = {IoEvent::frame_end, CounterReset::acquisition_start, 1};
        s.frame_trigger.source = TriggerSource::timer1_end;
        s.start_trigger = {true, TriggerSource::counter0_end, TriggerActivation::rising_edge};
    });
    f.start();
    f.router.frame_begun({1, f.at(0), f.at(8), f.at(1), f.at(5)});
    const CameraActivity a = f.router.activity();
    CHECK(a.frames == 1);
    CHECK(a.frame_end == f.at(8));
    CHECK(f.router.moments().exposure_start == f.at(1));
    CHECK(f.router.moments().frame_id == 1);
    f.run_to(7);
    CHECK(f.router.activity().start_awaited);
    f.run_to(8);
    CHECK_FALSE(f.router.activity().start_awaited);
    f.run_to(30);
    CHECK(f.frames() == Instants{15});
}

} // namespace trigger_router_events_test
