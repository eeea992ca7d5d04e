// SPDX-License-Identifier: Apache-2.0
// Further lines, levels, the width of a pulse, and the ends of counters and timers as triggers.
#include "emulator/camera/camera.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <functional>
#include <vector>

namespace trigger_lines_test {

using namespace obscura;
using namespace obscura::test;

namespace {

/// A camera whose Line0 and Line2 tell of both edges.
struct Bench : CameraBench {
    explicit Bench(const std::function<void(CameraSettings&)>& adjust)
        : CameraBench(small_sensor(), 12, adjust, sync::OverTrigger::count, emulator::LatePolicy::late,
                      true) {}

    Time edge(std::size_t line, bool falling = false) { return edge(line, clock.now(), falling); }
    Time edge(std::size_t line, Time t, bool falling) {
        sync::Trigger trigger{++ids[line], t, clock.now()};
        trigger.falling = falling;
        camera.line(line).on_trigger(trigger);
        return t;
    }
    void stop() {
        camera.acquisition_stop(false);
        releaser.wait_idle();
        loopback.stop();
    }
    [[nodiscard]] std::vector<Time> frame_edges() {
        stop();
        std::vector<Time> edges;
        for (const FrameRef& frame : loopback.kept())
            edges.push_back(frame->info.trigger_edge);
        return edges;
    }
    std::array<std::uint64_t, line_count> ids{};
};

void pause_ms(int ms) {
    std::this_thread::sleep_for(std::chrono::milliseconds(ms));
}

} // namespace

TEST_CASE("each line is a source of its own, and frames say which one it was") {
    Bench bench([](CameraSettings& s) {
        s.frame_trigger.source = TriggerSource::line2;
        s.frame_trigger.activation = TriggerActivation::falling_edge;
        s.start_trigger = {true, TriggerSource::line1, TriggerActivation::rising_edge};
    });
    REQUIRE(bench.camera.acquisition_start());
    bench.edge(2, true); // the acquisition waits for Line1
    bench.edge(0);
    bench.edge(1);
    bench.edge(0);
    bench.edge(2);
    const Time taken = bench.edge(2, true);
    bench.wait_ended(1);
    const CameraActivity a = bench.camera.activity();
    CHECK(a.lines[0].edges == 2);
    CHECK(a.lines[1].edges == 1);
    CHECK(a.lines[2].edges == 3);
    CHECK(a.lines[2].edge == taken);
    CHECK_FALSE(a.lines[2].high);
    CHECK(a.lines[0].high);
    CHECK(bench.frame_edges() == std::vector{taken});
    CHECK(bench.loopback.kept()[0]->info.line_status == line_status_line0 << 2);
    CHECK(bench.camera.counters().missed_triggers == 0);
    CHECK(bench.camera.counters().triggers == 1);
}

TEST_CASE("while a level holds, frames follow each other at the frame rate") {
    Bench bench([](CameraSettings& s) {
        s.frame_trigger.activation = TriggerActivation::level_high;
        s.frame_rate_hz = 200;
    });
    REQUIRE(bench.camera.acquisition_start());
    pause_ms(20);
    CHECK(bench.camera.counters().frames == 0); // low until the first edge
    const Time begin = bench.edge(0);
    bench.wait_ended(4);
    const Time end = bench.edge(0, true);
    bench.wait_ready();
    pause_ms(20);
    const std::uint64_t frames = bench.camera.counters().frames;
    pause_ms(20);
    CHECK(bench.camera.counters().frames == frames);
    bench.stop();
    for (const FrameRef& frame : bench.loopback.kept()) {
        const std::int64_t since = frame->info.trigger_edge - begin;
        CHECK(since % (5 * ns_per_ms) == 0);
        CHECK(frame->info.trigger_edge <= end);
    }
    CHECK(bench.loopback.kept()[0]->info.trigger_edge == begin);

    // A level that is there when the acquisition begins counts at once; one that goes and comes, anew.
    Bench low([](CameraSettings& s) {
        s.frame_trigger.activation = TriggerActivation::level_low;
        s.start_trigger = {true, TriggerSource::line2, TriggerActivation::level_high};
    });
    low.edge(2);
    REQUIRE(low.camera.acquisition_start());
    low.wait_ended(2);
    low.edge(0); // high: enough
    low.wait_ready();
    pause_ms(20);
    const std::uint64_t until = low.camera.counters().frames;
    low.edge(0, true);
    low.wait_ended(static_cast<std::uint32_t>(until) + 1);
    CHECK_FALSE(low.camera.activity().start_awaited);
}

TEST_CASE("levels are for lines that tell of both edges, and not for every trigger") {
    Bench bench({});
    const CameraSettings plain = bench.camera.settings();
    CameraSettings s = plain;
    s.frame_trigger.activation = TriggerActivation::level_high;
    CHECK(bench.camera.apply(s));
    s.frame_trigger.source = TriggerSource::line1;
    CHECK(bench.camera.explain(s) == "TriggerActivation[FrameStart]: Line1 reports rising edges only");
    CHECK_FALSE(bench.camera.apply(s));
    s = plain;
    s.burst_trigger.activation = TriggerActivation::level_low;
    CHECK_FALSE(bench.camera.apply(s));
    s = plain;
    s.frame_trigger.activation = TriggerActivation::level_high;
    s.exposure_trigger.enabled = true;
    CHECK_FALSE(bench.camera.apply(s));
    s = plain;
    s.exposure_mode = ExposureMode::trigger_width;
    CHECK(bench.camera.apply(s));
    s.exposure_auto = ExposureAuto::once;
    CHECK_FALSE(bench.camera.apply(s));
    CameraLimits rising = bench.camera.limits();
    rising.lines = {LineEdges{.rising = true}};
    s.exposure_auto = ExposureAuto::off;
    CHECK(explain_invalid(s, rising) == "ExposureMode TriggerWidth: no line's source reports both edges");
}

TEST_CASE("the width of the trigger's pulse is the exposure") {
    const bool by_exposure_trigger = GENERATE(false, true);
    CAPTURE(by_exposure_trigger);
    Bench bench([&](CameraSettings& s) {
        s.exposure_mode = ExposureMode::trigger_width;
        const TriggerChoice pulse{true, TriggerSource::line2, TriggerActivation::falling_edge};
        if (by_exposure_trigger) {
            s.frame_trigger.enabled = false;
            s.exposure_trigger = pulse;
        } else {
            s.frame_trigger.source = pulse.source;
            s.frame_trigger.activation = pulse.activation;
        }
    });
    REQUIRE(bench.camera.acquisition_start());
    // Stamps of the bench, which may lie apart from when they come.
    Time t = bench.clock.now();
    const std::vector<std::int64_t> widths{2'000'000, 700'000, 3'500'000};
    std::vector<Time> begun;
    bench.edge(2, t, false); // ends no pulse
    for (std::size_t k = 0; k < widths.size(); ++k) {
        t += 20 * ns_per_ms;
        bench.wait_ready();
        begun.push_back(bench.edge(2, t, true));
        CHECK(bench.camera.counters().frames == k); // not before it ends
        bench.edge(0);
        bench.edge(2, t + widths[k], false);
        bench.wait_ended(static_cast<std::uint32_t>(k) + 1);
    }
    // An acquisition that ends in the middle of a pulse forgets it.
    bench.wait_ready();
    t += 20 * ns_per_ms;
    bench.edge(2, t, true);
    bench.camera.acquisition_stop(false);
    REQUIRE(bench.camera.acquisition_start());
    bench.edge(2, t + 1'000'000, false);
    CHECK(bench.frame_edges() == begun);
    const std::vector<FrameRef> kept = bench.loopback.kept();
    for (std::size_t k = 0; k < widths.size(); ++k) {
        CHECK(kept[k]->info.windows[0].exposure_requested_ns == widths[k]);
        CameraSettings timed = bench.camera.settings();
        timed.exposure_ns = widths[k]; // the chip has its grid for this as for that
        CHECK(kept[k]->row_times()[0].exposure_ns() ==
              bench.camera.readout(timed).windows[0].exposure_max_ns);
    }
    CHECK(bench.camera.counters().missed_triggers == 0);
}

TEST_CASE("without a pulse to measure, exposures are timed") {
    Bench bench([](CameraSettings& s) { s.exposure_mode = ExposureMode::trigger_width; });
    CameraSettings s = bench.camera.settings();
    REQUIRE(bench.camera.acquisition_start());
    std::uint32_t frames = 0;
    const auto take = [&](TriggerSource source, const std::function<void()>& trigger) {
        s.frame_trigger.source = source;
        REQUIRE(bench.camera.apply(s));
        bench.wait_ready();
        trigger();
        bench.wait_ended(++frames);
    };
    take(TriggerSource::software, [&] { bench.camera.software_trigger(bench.clock.now()); });
    take(TriggerSource::line1, [&] { bench.edge(1); }); // tells of rising edges only
    bench.stop();
    for (const FrameRef& frame : bench.loopback.kept())
        CHECK(frame->info.windows[0].exposure_requested_ns == s.exposure_ns);
}

TEST_CASE("the end of a counter is a trigger, once or every so many events") {
    const CounterReset reset = GENERATE(CounterReset::off, CounterReset::counter_end);
    CAPTURE(static_cast<int>(reset));
    Bench bench([&](CameraSettings& s) {
        s.counters[1] = {IoEvent::line0, reset, 3};
        s.frame_trigger.source = TriggerSource::counter1_end;
    });
    bench.edge(0); // before the acquisition: counted all the same
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.reset_counter(1);
    std::vector<Time> ends;
    for (int k = 1; k <= 9; ++k) {
        bench.wait_ready();
        const Time t = bench.edge(0);
        if (k % 3 != 0 || (reset == CounterReset::off && k > 3)) continue;
        ends.push_back(t);
        bench.wait_ended(static_cast<std::uint32_t>(ends.size()));
    }
    const IoInputs in = io_inputs(bench.camera, bench.clock);
    CHECK(counter_value(bench.camera.settings().counters[1], 1, in) == (reset == CounterReset::off ? 3 : 0));
    if (reset == CounterReset::off) { // a reset lets it end once more
        bench.camera.reset_counter(1);
        for (int k = 1; k <= 3; ++k) {
            bench.wait_ready();
            ends.resize(1);
            ends.push_back(bench.edge(0));
        }
        bench.wait_ended(2);
    }
    CHECK(bench.frame_edges() == ends);
    CHECK(bench.camera.counters().missed_triggers == 0);
}

TEST_CASE("a counter of missed triggers triggers nothing, or it would for ever") {
    Bench bench([&](CameraSettings& s) {
        s.counters[0] = {IoEvent::frame_trigger_missed, CounterReset::counter_end, 1};
        s.frame_trigger.source = TriggerSource::counter0_end;
        s.burst_trigger = {true, TriggerSource::software, TriggerActivation::rising_edge};
    });
    REQUIRE(bench.camera.acquisition_start());
    REQUIRE(bench.camera.software_burst_trigger(bench.clock.now()));
    CHECK_FALSE(bench.camera.software_burst_trigger(bench.clock.now())); // missed, in the middle of a burst
    pause_ms(10);
    CHECK(bench.camera.counters().missed_triggers == 1);
    CHECK(bench.camera.counters().triggers == 1);
}

TEST_CASE("the end of a timer is a trigger at its exact instant") {
    Bench bench([](CameraSettings& s) {
        s.timers[0] = {IoEvent::line1, 10 * ns_per_ms, 40 * ns_per_ms};
        s.frame_trigger.source = TriggerSource::timer0_end;
    });
    bench.edge(1); // in the past when the acquisition begins
    pause_ms(60);
    REQUIRE(bench.camera.acquisition_start());
    const Time first = bench.edge(1);
    bench.wait_ended(1);
    bench.wait_ready();
    bench.edge(1);
    const Time restarted = bench.edge(1); // each start is anew
    bench.wait_ended(2);
    bench.wait_ready();
    bench.edge(1);
    bench.camera.reset_timer(0);
    pause_ms(60);
    CHECK(bench.frame_edges() == std::vector{first + 50 * ns_per_ms, restarted + 50 * ns_per_ms});
}

TEST_CASE("a timer that a frame starts, and that starts the next one, is a clock") {
    // Long enough for a busy machine to change the source before the timer ends.
    constexpr std::int64_t pause_ns = ns_per_s;
    Bench bench([](CameraSettings& s) {
        s.timers[1] = {IoEvent::exposure_end, 0, pause_ns};
        s.frame_trigger.source = TriggerSource::software;
    });
    REQUIRE(bench.camera.acquisition_start());
    REQUIRE(bench.camera.software_trigger(bench.clock.now())); // something has to begin it
    bench.wait_ended(1);
    const Time exposed = bench.camera.activity().exposure_end;
    CameraSettings s = bench.camera.settings();
    s.frame_trigger.source = TriggerSource::timer1_end;
    REQUIRE(bench.camera.apply(s));
    if (bench.clock.now() >= exposed + pause_ns) {
        WARN("not looked at: this machine took a second to change the source, and no timer ended after that");
        return;
    }
    bench.wait_ended(3);
    const std::vector<Time> edges = bench.frame_edges();
    CHECK(edges[1] == exposed + pause_ns);
    CHECK(edges[2] - edges[1] == edges[1] - edges[0]);
}

} // namespace trigger_lines_test
