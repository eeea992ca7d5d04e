// SPDX-License-Identifier: Apache-2.0
// TriggerRouter: SFNC TriggerSelector, TriggerDivider, gaps in the ids, over-trigger policies, threads.
#include "tests/unit/emulator/router_fixture.hpp"

#include <atomic>
#include <thread>

namespace trigger_router_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

TEST_CASE("the next edge of a line is known before the acquisition, where the edge alone makes the frame") {
    RouterFixture bench([](CameraSettings& s) { s.frame_trigger = {true, TriggerSource::line0}; });
    CHECK_FALSE(bench.router.next_line_edge(bench.clock.now()));
    for (const std::int64_t t : {10, 30, 50, 70})
        bench.edge(0, t);
    CHECK(bench.router.next_line_edge(bench.at(70)) == bench.at(90));
    CHECK(bench.router.next_line_edge(bench.at(90)) == bench.at(110));
    CHECK(bench.router.next_line_edge(bench.at(895)) == bench.at(910)); // edges that did not come count
    // What the source says comes first.
    bench.router.line(1).on_trigger(
        {.id = 1, .edge = bench.at(70), .seen = bench.at(70), .next = bench.at(77)});
    CHECK(bench.router.next_line_edge(bench.at(75)) != bench.at(77));
    bench.apply([](CameraSettings& s) { s.frame_trigger.source = TriggerSource::line1; });
    CHECK(bench.router.next_line_edge(bench.at(75)) == bench.at(77));

    const std::function<void(CameraSettings&)> others[] = {
        [](CameraSettings& s) { s.frame_trigger.enabled = false; },
        [](CameraSettings& s) { s.frame_trigger.source = TriggerSource::software; },
        [](CameraSettings& s) { s.frame_trigger.activation = TriggerActivation::level_high; },
        [](CameraSettings& s) { s.trigger_divider = 2; },
        [](CameraSettings& s) { s.start_trigger.enabled = true; },
        [](CameraSettings& s) { s.burst_trigger.enabled = true; },
        [](CameraSettings& s) { s.exposure_trigger.enabled = true; },
        [](CameraSettings& s) { s.exposure_mode = ExposureMode::trigger_width; },
    };
    const CameraSettings plain = bench.settings;
    for (std::size_t i = 0; i < std::size(others); ++i) {
        CAPTURE(i);
        bench.apply(others[i]);
        CHECK_FALSE(bench.router.next_line_edge(bench.at(75)));
        bench.apply([&plain](CameraSettings& s) { s = plain; });
        CHECK(bench.router.next_line_edge(bench.at(75)));
    }
    // Only edges of the chosen direction count, one of two.
    for (const std::int64_t t : {100, 120, 140, 160}) {
        bench.edge(2, t);
        bench.edge(2, t + 3, true);
    }
    bench.apply([](CameraSettings& s) {
        s.frame_trigger = {true, TriggerSource::line2, TriggerActivation::falling_edge};
    });
    CHECK(bench.router.next_line_edge(bench.at(165)) == bench.at(183));
    bench.apply([](CameraSettings& s) { s.frame_trigger.activation = TriggerActivation::any_edge; });
    CHECK_FALSE(bench.router.next_line_edge(bench.at(165)));
}

TEST_CASE("an edge of FrameStart's line is one frame request with the edge's own stamp", "[emulator]") {
    RouterFixture f({});
    f.edge(0, 1); // not acquiring
    f.start();
    f.edge(1, 2); // another line
    f.clock.advance_to(f.at(5));
    f.router.line(0).on_trigger({2, f.at(3), f.at(4)});
    f.serve();
    REQUIRE(f.requests.size() == 1);
    CHECK(f.requests[0].id == 2);
    CHECK(f.requests[0].edge == f.at(3));
    CHECK(f.requests[0].seen == f.at(4));
    CHECK(f.counters().ignored == 2);
    CHECK(f.missed.empty());
    f.router.acquisition_stop(true);
    f.edge(0, 6);
    CHECK(f.requests.size() == 1);
}

TEST_CASE("software and action triggers have ids of their own", "[emulator]") {
    RouterFixture f([](CameraSettings& s) { s.frame_trigger.source = TriggerSource::software; });
    CHECK_FALSE(f.router.software_frame_start(f.at(0)));
    f.start();
    f.run_to(3);
    CHECK(f.router.software_frame_start(f.at(2)));
    f.serve();
    CHECK_FALSE(f.router.action(f.at(3)));
    f.apply([](CameraSettings& s) { s.frame_trigger.source = TriggerSource::action1; });
    f.run_to(5);
    CHECK(f.router.action(f.at(5)));
    f.serve();
    CHECK_FALSE(f.router.software_frame_start(f.at(6)));
    CHECK(f.frames() == Instants{2, 5});
    CHECK(f.requests[0].id == 2);
    CHECK(f.requests[1].id == 2);
    CHECK(f.requests[1].seen == f.at(5));
    CHECK(f.counters().missed == 0);
}

TEST_CASE("the edge of AcquisitionStart makes no frame, and none is made before it", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.start_trigger = {true, TriggerSource::line1, TriggerActivation::rising_edge};
    });
    f.start();
    CHECK(f.router.activity().start_awaited);
    CHECK_FALSE(f.router.ready());
    f.edge(0, 1);
    CHECK_FALSE(f.router.software_acquisition_start());
    f.edge(1, 2);
    CHECK_FALSE(f.router.activity().start_awaited);
    CHECK(f.router.ready_for_line(0, f.at(3)));
    f.edge(0, 3);
    f.edge(1, 4); // listened to once only
    f.edge(0, 5);
    CHECK(f.frames() == Instants{3, 5});
    CHECK(f.counters().missed == 0);
    CHECK(f.counters().ignored == 1);
    f.router.acquisition_stop(true);
    f.start(); // anew with each acquisition
    CHECK(f.router.activity().start_awaited);
}

TEST_CASE("a level that AcquisitionStart finds high starts at once", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.start_trigger = {true, TriggerSource::line2, TriggerActivation::level_high};
    });
    f.edge(2, 1);
    f.start();
    CHECK_FALSE(f.router.activity().start_awaited);
    f.router.acquisition_stop(true);
    f.edge(2, 2, true);
    f.start();
    CHECK(f.router.activity().start_awaited);
    f.edge(2, 3);
    f.edge(0, 4);
    CHECK(f.frames() == Instants{4});
}

TEST_CASE("FrameBurstStart lets so many edges of FrameStart through", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.burst_trigger = {true, TriggerSource::line1, TriggerActivation::rising_edge};
        s.burst_frame_count = 2;
    });
    f.start();
    f.edge(0, 1);
    CHECK_FALSE(f.router.ready());
    f.edge(1, 2);
    CHECK(f.router.ready());
    f.edge(0, 3);
    f.edge(1, 4); // in the middle of a burst
    f.edge(0, 5);
    CHECK_FALSE(f.router.ready());
    CHECK(f.frames() == Instants{3, 5});
    CHECK(f.counters().missed == 1);
    CHECK(f.missed == std::vector{f.at(4)});
    f.edge(1, 6);
    f.edge(0, 7);
    f.router.acquisition_stop(true);
    f.start(); // forgets the frame that is left
    f.edge(0, 8);
    CHECK(f.frames() == Instants{3, 5, 7});
}

TEST_CASE("edges that FrameBurstStart consumes are no gaps in the ids of FrameStart", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.burst_trigger.enabled = true;
        s.burst_frame_count = 2;
    });
    f.start();
    for (std::int64_t t = 1; t <= 6; ++t)
        f.edge(0, 2 * t);
    CHECK(f.frames() == Instants{4, 6, 10, 12});
    CHECK(f.counters().lost == 0);
    f.edge(0, 14);
    ++f.ids[0]; // one that is lost indeed
    f.edge(0, 16);
    CHECK(f.counters().lost == 1);
}

TEST_CASE("a burst without FrameStart is paced at the frame period until it is complete", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.frame_trigger.enabled = false;
        s.burst_trigger = {true, TriggerSource::software, TriggerActivation::rising_edge};
        s.burst_frame_count = 3;
    });
    CHECK_FALSE(f.router.software_burst_start(f.at(0)));
    f.start();
    f.run_to(20);
    CHECK(f.router.software_burst_start(f.at(20)));
    CHECK_FALSE(f.router.software_burst_start(f.at(20)));
    f.run_to(50);
    CHECK(f.frames() == Instants{20, 25, 30});
    // Edges at which the pipeline is busy are missed, and made up for.
    CHECK(f.router.software_burst_start(f.at(50)));
    f.pipeline_held = true;
    f.run_to(52);
    f.begin_frame();
    f.run_to(62);
    f.router.gate().finished();
    f.pipeline_held = false;
    f.run_to(100);
    CHECK(f.frames() == Instants{20, 25, 30, 50, 65, 70});
    CHECK(f.counters().missed == 3);
    CHECK(f.missed == std::vector{f.at(20), f.at(55), f.at(60)});
}

TEST_CASE("FrameStart arms ExposureStart, whose next edge is the frame", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.frame_trigger.source = TriggerSource::software;
        s.exposure_trigger = {true, TriggerSource::line0, TriggerActivation::rising_edge};
    });
    f.start();
    f.edge(0, 1); // not armed
    CHECK(f.router.software_frame_start(f.at(1)));
    CHECK_FALSE(f.router.software_frame_start(f.at(1))); // armed already
    CHECK(f.missed == std::vector{f.at(1)});
    CHECK_FALSE(f.router.software_exposure_start(f.at(1)));
    f.edge(0, 2);
    f.edge(0, 3); // once only
    CHECK(f.frames() == Instants{2});
    CHECK(f.router.software_frame_start(f.at(3)));
    f.router.acquisition_stop(true);
    f.start(); // not armed any more
    f.edge(0, 4);
    CHECK(f.frames() == Instants{2});
    CHECK(f.counters().missed == 1);
}

TEST_CASE("ExposureStart without FrameStart is always armed", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.frame_trigger.enabled = false;
        s.exposure_trigger = {true, TriggerSource::software, TriggerActivation::rising_edge};
    });
    f.start();
    for (const std::int64_t t : {1, 3}) {
        f.run_to(t);
        CHECK(f.router.software_exposure_start(f.at(t)));
        f.serve();
    }
    CHECK(f.frames() == Instants{1, 3});
}

TEST_CASE("with one line for FrameStart and ExposureStart, every second edge exposes", "[emulator]") {
    RouterFixture f([](CameraSettings& s) { s.exposure_trigger.enabled = true; });
    f.start();
    for (std::int64_t t = 1; t <= 4; ++t)
        f.edge(0, 2 * t);
    CHECK(f.frames() == Instants{4, 8});
    CHECK(f.counters().missed == 0);
}

TEST_CASE("of the edges of an acquisition the first counts, then every TriggerDivider-th", "[emulator]") {
    RouterFixture f([](CameraSettings& s) { s.trigger_divider = 3; });
    f.ids[0] = 40;
    f.start();
    for (std::int64_t t = 1; t <= 7; ++t)
        f.edge(0, t);
    CHECK(f.frames() == Instants{1, 4, 7});
    CHECK(f.counters().edges == 3);
    CHECK(f.counters().lost == 0);
    f.ids[0] += 5; // one of them would have counted
    f.edge(0, 20);
    CHECK(f.frames().back() == 20);
    CHECK(f.counters().lost == 1);
    f.router.acquisition_stop(true);
    f.start();
    f.edge(0, 30);
    f.edge(0, 31);
    CHECK(f.frames().back() == 30);
}

TEST_CASE("gaps in the ids of the selected source are missed edges", "[emulator]") {
    RouterFixture f({});
    f.start();
    f.edge(0, 1);
    f.ids[0] += 3;
    f.edge(0, 5);
    CHECK(f.frames() == Instants{1, 5});
    CHECK(f.counters().lost == 3);
    CHECK(f.counters().missed == 3);
    CHECK(f.missed == std::vector{f.at(5)});
    // With a dual-edge input inactive edges are no gaps, and half of the lost ones were active.
    f.apply([](CameraSettings& s) {
        s.frame_trigger = {true, TriggerSource::line2, TriggerActivation::rising_edge};
    });
    for (std::int64_t t = 10; t <= 14; t += 2) {
        f.edge(2, t);
        f.edge(2, t + 1, true);
    }
    CHECK(f.counters().lost == 3);
    f.ids[2] += 4;
    f.edge(2, 20);
    CHECK(f.counters().lost == 5);
    CHECK(f.frames() == Instants{1, 5, 10, 12, 14, 20});
}

TEST_CASE("edges before the camera is ready follow the over-trigger policy", "[emulator]") {
    const auto run = [](RouterFixture& f) {
        f.start();
        f.pipeline_held = true;
        f.edge(0, 1);
        REQUIRE(f.router.gate().pending());
        f.begin_frame();
        f.edge(0, 2);
        f.edge(0, 3);
        f.router.gate().finished();
        f.pipeline_held = false;
        f.run_to(4);
    };
    SECTION("count") {
        RouterFixture f({});
        run(f);
        CHECK(f.frames() == Instants{1});
        CHECK(f.counters().missed == 2);
        CHECK(f.missed == std::vector{f.at(2), f.at(3)});
    }
    SECTION("ignore") {
        RouterFixture f({}, sync::OverTrigger::ignore);
        run(f);
        CHECK(f.frames() == Instants{1});
        CHECK(f.counters().masked == 2);
        CHECK(f.missed.empty());
    }
    SECTION("TriggerOverlap PreviousFrame latches the first, whatever the configuration") {
        const sync::OverTrigger configured = GENERATE(sync::OverTrigger::count, sync::OverTrigger::ignore);
        RouterFixture f([](CameraSettings& s) { s.trigger_overlap = TriggerOverlap::previous_frame; },
                        configured);
        run(f);
        CHECK(f.frames() == Instants{1, 2});
        CHECK(f.counters().latched == 1);
        CHECK(f.counters().missed == 1);
        CHECK(f.missed == std::vector{f.at(3)});
    }
    SECTION("a latched edge that came before the chip's frame period takes effect at its end") {
        RouterFixture f([](CameraSettings& s) { s.trigger_overlap = TriggerOverlap::previous_frame; });
        f.start();
        f.pipeline_held = true;
        f.edge(0, 1);
        f.begin_frame(); // ready again at 2 ms
        f.router.line(0).on_trigger({++f.ids[0], f.at(1) + ms / 4, f.clock.now()});
        f.router.gate().finished();
        f.pipeline_held = false;
        f.serve();
        REQUIRE(f.requests.size() == 2);
        CHECK(f.held_ns[1] == 3 * ms / 4);
        CHECK(f.router.moments().not_before == f.at(3));
    }
}

TEST_CASE("free run takes its own edges only, after AcquisitionStart", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.frame_trigger.enabled = false;
        s.start_trigger = {true, TriggerSource::software, TriggerActivation::rising_edge};
    });
    f.start();
    f.router.free_run().on_trigger({1, f.at(0), f.at(0)});
    f.serve();
    CHECK(f.router.software_acquisition_start());
    f.edge(0, 1);
    f.router.free_run().on_trigger({2, f.at(2), f.at(2)});
    f.serve();
    CHECK_FALSE(f.router.software_frame_start(f.at(3)));
    CHECK(f.frames() == Instants{2});
    CHECK(f.counters().ignored == 2);
    CHECK_FALSE(f.router.ready_for_line(0, f.at(9)));
}

TEST_CASE("another source forgets the burst and the armed exposure in progress", "[emulator]") {
    RouterFixture f([](CameraSettings& s) {
        s.burst_trigger = {true, TriggerSource::line1, TriggerActivation::rising_edge};
        s.burst_frame_count = 5;
    });
    f.start();
    f.edge(1, 1);
    f.edge(0, 2);
    f.apply([](CameraSettings& s) { s.frame_trigger.source = TriggerSource::line2; });
    CHECK_FALSE(f.router.ready());
    f.edge(2, 3);
    f.edge(1, 4);
    f.edge(2, 5);
    CHECK(f.frames() == Instants{2, 5});
}

TEST_CASE("lines record their edges whether or not they are listened to", "[emulator]") {
    RouterFixture f({});
    const std::uint32_t seen = f.router.moments_changed().value();
    f.edge(3, 1);
    f.edge(3, 2, true);
    f.edge(3, 3);
    const CameraActivity a = f.router.activity();
    CHECK(a.lines[3].edges == 3);
    CHECK(a.lines[3].edge == f.at(3));
    CHECK(a.lines[3].high);
    CHECK(a.lines[0].edges == 0);
    CHECK(a.acquisitions == 0);
    CHECK(f.router.moments_changed().value() == seen);
    f.start();
    CHECK(f.router.activity().acquisitions == 1);
    CHECK(f.router.activity().acquisition_start == f.at(3));
    CHECK(f.router.moments_changed().value() != seen);
}

TEST_CASE("sources, control side, alarms and pipeline run on threads of their own", "[emulator]") {
    struct Missed final : sync::MissedListener {
        void on_missed(Time) noexcept override { ++count; }
        std::atomic<std::uint64_t> count{0};
    } missed;
    MonotonicClock clock;
    CameraSettings settings;
    settings.counters[0] = {IoEvent::line1, CounterReset::counter_end, 2};
    settings.timers[0] = {IoEvent::line3, 0, 1000};
    const LineEdges both{true, true};
    TriggerRouter router(
        {{both, both, both, both}, sync::OverTrigger::count}, settings, clock, missed,
        [](Alarm::Handler handler) { return std::make_unique<Alarm>(ThreadSettings{}, std::move(handler)); });
    std::uint64_t frames = 0;
    std::thread pipeline([&] {
        while (router.gate().wait()) {
            const Time edge = router.gate().current().edge;
            router.frame_begun({++frames, edge, edge + 3000, edge + 1000, edge + 2000});
            router.gate().started(edge);
            router.gate().finished();
            router.moments_changed().notify();
        }
    });
    std::atomic<bool> done{false};
    std::vector<std::thread> sources;
    for (std::size_t line = 0; line < line_count; ++line)
        sources.emplace_back([&, line] {
            for (std::uint64_t id = 1; !done; ++id) {
                sync::Trigger trigger{id, clock.now(), clock.now()};
                trigger.falling = id % 2 == 0;
                router.line(line).on_trigger(trigger);
                std::this_thread::yield();
            }
        });
    for (std::uint32_t round = 0; round < 400; ++round) {
        const auto source = static_cast<TriggerSource>(round % trigger_source_count);
        settings.frame_trigger = {round % 7 != 0, source, static_cast<TriggerActivation>(round % 5)};
        settings.exposure_trigger.enabled = round % 4 == 1;
        settings.burst_trigger.enabled = round % 4 == 2;
        settings.exposure_mode = round % 3 == 0 ? ExposureMode::trigger_width : ExposureMode::timed;
        settings.trigger_overlap = round % 2 == 0 ? TriggerOverlap::previous_frame : TriggerOverlap::readout;
        settings.timers[0].delay_ns = round;
        router.acquisition_stop(round % 2 == 0);
        router.set(settings);
        router.select(settings);
        router.set_frame_period(20'000);
        router.acquisition_start(settings, clock.now());
        router.resume_level();
        router.reset_counter(0);
        router.reset_timer(0);
        router.software_frame_start(clock.now());
        router.software_burst_start(clock.now());
        router.software_exposure_start(clock.now());
        clock.sleep_until(clock.now() + 100'000);
        (void)router.activity();
        (void)router.moments();
    }
    done = true;
    for (std::thread& source : sources)
        source.join();
    router.acquisition_stop(true);
    router.gate().quit();
    pipeline.join();
    const sync::GateCounters c = router.counters();
    CHECK(c.taken == frames);
    CHECK(frames > 0);
    CHECK(c.edges + c.lost == c.taken + c.missed + c.masked);
    CHECK(missed.count <= c.missed);
}

} // namespace trigger_router_test
