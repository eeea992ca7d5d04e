// SPDX-License-Identifier: Apache-2.0
// Triggers that misbehave: each case has an outcome that is counted, and no frame shows another instant than
// its own.
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

namespace trigger_edge_cases_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

constexpr std::int64_t ms = ns_per_ms;
constexpr std::int64_t period_ns = 20 * ms;

std::vector<std::int64_t> series(int count, std::int64_t first_ns = 0, std::int64_t period = period_ns) {
    std::vector<std::int64_t> edges;
    for (int i = 0; i < count; ++i)
        edges.push_back(first_ns + i * period);
    return edges;
}

std::vector<std::int64_t> joined(std::vector<std::int64_t> a, const std::vector<std::int64_t>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
}

/// What became of edges, ns after the first. The scene follows the clock and moves by 10 px/s, the tolerance
/// is 2 ms.
struct Run {
    explicit Run(const std::vector<std::int64_t>& edges, bool waits = true)
        : bench(small_sensor(), 3, {}, sync::OverTrigger::count, LatePolicy::late, false,
                {.mode = SceneTime::clock}, RendersOn::own_thread) {
        REQUIRE(bench.camera.acquisition_start());
        bench.wait_ready();
        const Time first = bench.clock.now() + 5 * ms;
        std::uint32_t frames = 0;
        for (std::size_t i = 0; i < edges.size(); ++i) {
            const Time edge = first + edges[i];
            if (waits) bench.wait_ready();
            bench.clock.sleep_until(edge);
            const std::uint64_t missed = bench.camera.counters().missed_triggers;
            bench.camera.on_trigger({i + 1, edge, bench.clock.now()});
            if (waits && bench.camera.counters().missed_triggers == missed) bench.wait_ended(++frames);
        }
        bench.camera.acquisition_stop(false);
        bench.releaser.wait_idle();
        bench.loopback.stop();
        counters = bench.camera.counters();
    }
    /// Frames among the last three whose pixels are not those of the instant that their truth states.
    [[nodiscard]] int shown_wrongly() {
        MakerBench offline;
        int wrong = 0;
        for (const FrameRef& frame : bench.loopback.kept()) {
            FrameOrder order;
            order.frame_id = frame->info.frame_id;
            order.settings = bench.camera.settings();
            const FrameRef again = offline.pool.acquire();
            REQUIRE(offline.maker.prepare(order, *again).empty());
            // The truth of the test renderer has the time that is shown at mid-exposure.
            const double off_s =
                frame->info.truth.camera.position_m.x - again->info.truth.camera.position_m.x;
            order.scene_time += std::llround(off_s * 1e9);
            REQUIRE(offline.maker.make(order, *again).empty());
            wrong +=
                std::equal(again->pixels().begin(), again->pixels().end(), frame->pixels().begin()) ? 0 : 1;
        }
        return wrong;
    }

    CameraBench bench;
    CameraCounters counters;
};

} // namespace

TEST_CASE("a trigger that stops leaves its prepared frame unused, and one that goes on finds it discarded") {
    Run stops(series(6));
    CHECK(stops.counters.frames == 6);
    CHECK(stops.counters.missed_triggers == 0);
    CHECK(stops.counters.ahead.discarded == 0);
    CHECK(stops.counters.ahead.begun == stops.counters.ahead.used + 1); // the seventh, which never came
    // Ten periods later it goes on: those edges are not missed, they never were.
    Run goes_on(joined(series(6), series(3, 16 * period_ns)));
    CHECK(goes_on.counters.frames == 9);
    CHECK(goes_on.counters.missed_triggers == 0);
    CHECK(goes_on.counters.ahead.discarded == 1);
    CHECK(goes_on.counters.ahead.used == 3 + 2);
    CHECK(goes_on.shown_wrongly() == 0);
}

TEST_CASE("an edge that comes twice makes one frame, and the second edge is counted as missed") {
    std::vector<std::int64_t> edges;
    for (const std::int64_t edge : series(8)) {
        edges.push_back(edge);
        edges.push_back(edge + 10'000);
    }
    // All but the first edge of each pair come while the camera is busy.
    CameraBench bench(small_sensor(), 3, {}, sync::OverTrigger::count, LatePolicy::late, false,
                      {.mode = SceneTime::clock}, RendersOn::own_thread);
    REQUIRE(bench.camera.acquisition_start());
    const Time first = bench.clock.now() + 5 * ms;
    for (std::size_t i = 0; i < edges.size(); i += 2) {
        bench.wait_ready();
        bench.clock.sleep_until(first + edges[i]);
        bench.camera.on_trigger({i + 1, first + edges[i], bench.clock.now()});
        bench.camera.on_trigger({i + 2, first + edges[i + 1], bench.clock.now()});
        bench.wait_ended(static_cast<std::uint32_t>(i / 2 + 1));
    }
    bench.camera.acquisition_stop(false);
    const CameraCounters counters = bench.camera.counters();
    CHECK(counters.frames == 8);
    CHECK(counters.missed_triggers == 8);
    // The prediction does not notice: from the fourth frame on each is ready.
    CHECK(counters.ahead.used == 5);
    CHECK(counters.ahead.discarded == 0);
}

TEST_CASE("a trigger that drifts by 100 ppm is followed") {
    Run run(joined(series(8), series(24, 8 * period_ns, period_ns + period_ns / 10'000)));
    CHECK(run.counters.frames == 32);
    CHECK(run.counters.missed_triggers == 0);
    CHECK(run.counters.ahead.used == 29);
    CHECK(run.counters.ahead.discarded == 0);
}

TEST_CASE("a trigger that jumps by half a period costs one prepared frame and two that begin at their edge") {
    Run run(joined(series(8), series(8, 8 * period_ns + period_ns / 2)));
    CHECK(run.counters.frames == 16);
    CHECK(run.counters.missed_triggers == 0);
    CHECK(run.counters.ahead.discarded == 1);
    // Frames 4 to 8, then from the fourth edge after the jump on.
    CHECK(run.counters.ahead.used == 5 + 5);
    CHECK(run.counters.ahead.begun == run.counters.ahead.used + run.counters.ahead.discarded + 1);
    Run begins(joined(series(8), series(3, 8 * period_ns + period_ns / 2)));
    CHECK(begins.counters.ahead.used == 5);
    CHECK(begins.counters.ahead.discarded == 1);
    CHECK(begins.shown_wrongly() == 0); // of those three
}

TEST_CASE("pulses far faster than rendering are counted one by one") {
    // As 50 a second with half a second of rendering: 25 pulses a frame.
    constexpr int pulses = 100;
    render_gate().row_work = [](QualityLevel) {
        std::this_thread::sleep_for(std::chrono::microseconds(100'000 / 30));
    };
    Run run(series(pulses, 0, 4 * ms), false);
    render_gate().row_work = nullptr;
    CHECK(run.counters.frames >= 3);
    CHECK(run.counters.frames <= 12);
    CHECK(run.counters.frames + run.counters.missed_triggers == pulses);
    // The gaps of the trigger's numbers are those edges.
    std::uint64_t before = 0;
    for (const FrameRef& frame : run.bench.loopback.kept()) {
        CHECK(frame->info.trigger_id > before);
        before = frame->info.trigger_id;
    }
}

} // namespace trigger_edge_cases_test
