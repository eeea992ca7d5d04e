// SPDX-License-Identifier: Apache-2.0
// Rendering ahead of triggers: the same bytes, earlier; and what was expected wrongly is never shown.
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <algorithm>
#include <chrono>
#include <thread>
#include <vector>

namespace render_ahead_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

constexpr std::int32_t band_rows = 8;

FrameOrder order_for(const MakerBench& bench, std::uint64_t id) {
    FrameOrder order;
    order.frame_id = order.trigger_id = id;
    order.scene_time = Time{static_cast<std::int64_t>(id) * 100 * ns_per_ms};
    order.settings = whole_sensor(bench.sensor);
    return order;
}

std::vector<std::uint16_t> pixels_of(const Frame& frame) {
    return {frame.pixels().begin(), frame.pixels().end()};
}

/// Row blocks of a frame of the small sensor.
std::uint32_t blocks_of(const SensorDescription& sensor) {
    return static_cast<std::uint32_t>((sensor.readout.height + band_rows - 1) / band_rows);
}

/// Waits until `blocks` more have been rendered than `before`.
void wait_rendered(std::uint32_t before, std::uint32_t blocks) {
    while (render_gate().bands.load() - before < blocks)
        std::this_thread::sleep_for(std::chrono::microseconds(100));
}

/// Waits until the expected frame is rendered; not while frames are made.
void wait_expected(const FrameMaker& maker) {
    while (!maker.expected_is_ready())
        std::this_thread::yield();
}

/// Nothing can be rendered while it lives.
struct ClosedGate {
    ClosedGate() { render_gate().close(); }
    ~ClosedGate() { render_gate().open(); }
};

} // namespace

TEST_CASE("a frame that was expected is made while nothing can be rendered") {
    for (const Shutter shutter : {Shutter::rolling, Shutter::global, Shutter::push_broom}) {
        SensorDescription sensor = small_sensor();
        sensor.readout.shutter = shutter;
        MakerBench plain(sensor), bench(sensor, band_rows, RendersOn::own_thread);
        for (std::uint64_t id = 1; id <= 4; ++id) {
            FrameOrder order = order_for(bench, id);
            const std::uint32_t before = render_gate().bands;
            // The first lines are a block of their own.
            const std::uint32_t blocks = blocks_of(sensor) + (shutter == Shutter::push_broom ? 1 : 0);
            bench.maker.render_ahead({order});
            wait_expected(bench.maker);
            CHECK(render_gate().bands - before == blocks);
            // What only the trigger brings does not matter.
            order.trigger_edge = Time{12345 + static_cast<std::int64_t>(id)};
            order.settings.gain_db = 3;
            const FrameRef frame = bench.pool.acquire();
            {
                const ClosedGate closed;
                REQUIRE(bench.maker.make(order, *frame).empty());
            }
            const FrameRef same = plain.pool.acquire();
            REQUIRE(plain.maker.make(order, *same).empty());
            CHECK((pixels_of(*frame) == pixels_of(*same)));
            CHECK(frame->info.trigger_edge == order.trigger_edge);
        }
        const AheadCounters counters = bench.maker.ahead_counters();
        CHECK(counters.begun == 4);
        CHECK(counters.used == 4);
        CHECK(counters.early == 4);
        CHECK(counters.discarded == 0);
    }
}

TEST_CASE("a frame that turns out otherwise is rendered anew") {
    struct Change {
        const char* name;
        std::function<void(FrameOrder&)> apply;
    };
    const Change changes[] = {
        {"exposure", [](FrameOrder& o) { o.settings.exposure_ns += 100 * ns_per_us; }},
        {"scene time", [](FrameOrder& o) { o.scene_time += 1000; }},
        {"frame", [](FrameOrder& o) { ++o.frame_id; }},
        {"delay", [](FrameOrder& o) { o.settings.trigger_delay_ns = 5000; }},
        {"window",
         [](FrameOrder& o) {
             o.settings.region = {4, 2, 24, 20};
         }},
        {"windows",
         [](FrameOrder& o) {
             o.settings.set_windows(std::vector<CameraWindow>{{{0, 0, 40, 10}, o.settings.exposure_ns},
                                                              {{0, 14, 40, 10}, o.settings.exposure_ns}});
         }},
        {"another time shown", [](FrameOrder& o) { o.shown.shown += 77'000; }},
    };
    for (const Change& change : changes) {
        INFO(change.name);
        MakerBench plain, bench(small_sensor(), band_rows, RendersOn::own_thread);
        FrameOrder order = order_for(bench, 2);
        bench.maker.render_ahead({order});
        change.apply(order);
        const FrameRef frame = bench.pool.acquire(), same = plain.pool.acquire();
        REQUIRE(bench.maker.make(order, *frame).empty());
        REQUIRE(plain.maker.make(order, *same).empty());
        CHECK((pixels_of(*frame) == pixels_of(*same)));
        CHECK(bench.maker.ahead_counters().used == 0);
        CHECK(bench.maker.ahead_counters().discarded == 1);
    }
}

TEST_CASE("a new scene between the prediction and the edge is shown, and the old one may go") {
    MakerBench plain, bench(small_sensor(), band_rows, RendersOn::own_thread);
    const renderer::Renderer next(scene::Scene{}, {});
    const FrameOrder order = order_for(bench, 2);
    {
        const ClosedGate closed;
        bench.maker.render_ahead({order});
        render_gate().wait_for_render();
        bench.maker.replace_renderer(next);
        CHECK(bench.maker.uses(bench.renderer));
    }
    const FrameRef frame = bench.pool.acquire(), same = plain.pool.acquire();
    REQUIRE(bench.maker.make(order, *frame).empty());
    REQUIRE(plain.maker.make(order, *same).empty());
    CHECK((pixels_of(*frame) == pixels_of(*same)));
    CHECK(bench.maker.uses(next));
    CHECK_FALSE(bench.maker.uses(bench.renderer));
    CHECK(bench.maker.ahead_counters().discarded == 1);
}

TEST_CASE("an expected frame whose trigger comes early is finished, not begun again") {
    MakerBench plain, bench(small_sensor(), band_rows, RendersOn::own_thread);
    const FrameOrder order = order_for(bench, 2);
    const std::uint32_t before = render_gate().bands;
    render_gate().close();
    bench.maker.render_ahead({order});
    render_gate().wait_for_render();
    const FrameRef frame = bench.pool.acquire(), same = plain.pool.acquire();
    std::thread opens([&bench] {
        while (bench.maker.ahead_counters().used == 0)
            std::this_thread::yield();
        render_gate().open();
    });
    REQUIRE(bench.maker.make(order, *frame).empty());
    opens.join();
    CHECK(render_gate().bands - before == blocks_of(bench.sensor));
    CHECK(bench.maker.ahead_counters().used == 1);
    CHECK(bench.maker.ahead_counters().early == 0);
    REQUIRE(plain.maker.make(order, *same).empty());
    CHECK((pixels_of(*frame) == pixels_of(*same)));
}

TEST_CASE("a frame that is abandoned does not wait for the render thread") {
    MakerBench bench(small_sensor(), band_rows, RendersOn::own_thread);
    const FrameOrder order = order_for(bench, 2);
    std::atomic<bool> cancel{false};
    const FrameRef frame = bench.pool.acquire();
    render_gate().close();
    bench.maker.render_ahead({order});
    REQUIRE(bench.maker.prepare(order, *frame).empty());
    std::thread cancels([&cancel] {
        render_gate().wait_for_render();
        cancel = true;
    });
    CHECK_FALSE(bench.maker.fill(*frame, nullptr, &cancel));
    cancels.join();
    render_gate().open();
    // The next one is whole.
    const FrameRef next = bench.pool.acquire();
    REQUIRE(bench.maker.make(order_for(bench, 3), *next).empty());
    CHECK(next->complete());
}

TEST_CASE("a camera renders each frame before its edge, the first one too") {
    CameraBench bench(small_sensor(), 6, {}, sync::OverTrigger::count, LatePolicy::late, false, {},
                      RendersOn::own_thread);
    const std::uint32_t blocks = blocks_of(bench.sensor);
    const std::uint32_t before = render_gate().bands;
    REQUIRE(bench.camera.acquisition_start());
    for (std::uint64_t id = 1; id <= 5; ++id) {
        bench.wait_ready();
        wait_rendered(before, static_cast<std::uint32_t>(id) * blocks);
        wait_expected(bench.maker);
        if (id == 4) { // the client changes the exposure: the frame that was expected is of no use
            CameraSettings settings = bench.camera.settings();
            settings.exposure_ns *= 2;
            REQUIRE(bench.camera.apply(settings));
        }
        const bool expected = id != 4;
        if (expected) render_gate().close();
        const Time now = bench.clock.now();
        bench.camera.on_trigger({id, now, now});
        bench.wait_ended(static_cast<std::uint32_t>(id));
        render_gate().open();
        if (!expected) wait_rendered(before, 5 * blocks); // two of frame 4, and those after it
    }
    bench.camera.acquisition_stop(false);
    bench.releaser.wait_idle();
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 5);
    MakerBench offline;
    for (std::uint64_t id = 1; id <= 5; ++id) {
        FrameOrder order;
        order.frame_id = id;
        order.settings = bench.camera.settings();
        if (id < 4) order.settings.exposure_ns /= 2;
        order.scene_time = nominal_scene_time(order.settings, {10, 1}, id);
        const FrameRef again = offline.pool.acquire();
        REQUIRE(offline.maker.make(order, *again).empty());
        CHECK(std::equal(again->pixels().begin(), again->pixels().end(), kept[id - 1]->pixels().begin()));
    }
    const AheadCounters counters = bench.camera.counters().ahead;
    CHECK(counters.begun == 6); // the sixth, which never came
    CHECK(counters.used == 4);
    CHECK(counters.early == 4);
    CHECK(counters.discarded == 1);
    CHECK(bench.camera.counters().missed_triggers == 0);
}

TEST_CASE("an acquisition starts once its first frame is rendered, but does not wait for long") {
    CameraBench bench(small_sensor(), 1, {}, sync::OverTrigger::count, LatePolicy::late, false, {},
                      RendersOn::own_thread);
    constexpr auto max_wait = std::chrono::milliseconds(150);
    render_gate().close();
    std::atomic<bool> opened{false};
    std::thread opens([&opened] {
        std::this_thread::sleep_for(std::chrono::milliseconds(20));
        opened = true;
        render_gate().open();
    });
    const auto begin = std::chrono::steady_clock::now();
    REQUIRE(bench.camera.acquisition_start());
    // A busy machine may run the other thread later than the camera waits.
    CHECK((opened || std::chrono::steady_clock::now() - begin >= max_wait));
    opens.join();
    wait_expected(bench.maker);
    const Time now = bench.clock.now();
    bench.camera.on_trigger({1, now, now});
    bench.wait_ended(1);
    bench.camera.acquisition_stop(true);
    CHECK(bench.camera.counters().frames == 1);
    CHECK(bench.camera.counters().ahead.early == 1);
    const ClosedGate closed;
    REQUIRE(bench.camera.acquisition_start()); // although nothing renders
    bench.camera.acquisition_stop(true);
}

namespace {

/// Frames of a camera with those edges, ns after the first; `next`: what its source says of the edge after.
AheadCounters counters_of(SceneTime mode, const std::vector<std::int64_t>& edges, bool source_knows,
                          const std::function<void(CameraSettings&)>& adjust = {}) {
    CameraBench bench(small_sensor(), 1, adjust, sync::OverTrigger::count, LatePolicy::late, false,
                      {.mode = mode}, RendersOn::own_thread);
    REQUIRE(bench.camera.acquisition_start());
    const Time first = bench.clock.now() + 5 * ns_per_ms;
    for (std::size_t i = 0; i < edges.size(); ++i) {
        const Time edge = first + edges[i];
        bench.wait_ready();
        bench.clock.sleep_until(edge);
        sync::Trigger trigger{i + 1, edge, bench.clock.now()};
        if (source_knows && i + 1 < edges.size()) trigger.next = first + edges[i + 1];
        bench.camera.on_trigger(trigger);
        bench.wait_ended(static_cast<std::uint32_t>(i + 1));
    }
    bench.camera.acquisition_stop(false);
    CHECK(bench.camera.counters().frames == edges.size());
    return bench.camera.counters().ahead;
}

constexpr std::int64_t ms = ns_per_ms;

} // namespace

TEST_CASE("a scene that follows the clock is rendered for the edge that is predicted") {
    for (const SceneTime mode : {SceneTime::clock, SceneTime::tai}) {
        // Without a schedule, from the third edge on.
        const AheadCounters series =
            counters_of(mode, {0, 20 * ms, 40 * ms, 60 * ms, 80 * ms, 100 * ms}, false);
        CHECK(series.begun == 4);
        CHECK(series.used == 3);
        CHECK(series.discarded == 0);
        // With one, from the first on, and wherever the edges lie.
        const AheadCounters schedule = counters_of(mode, {0, 20 * ms, 31 * ms, 70 * ms}, true);
        CHECK(schedule.used == 3);
        CHECK(schedule.discarded == 0);
    }
}

TEST_CASE("an edge further off than the tolerance has its frame rendered anew") {
    // The scene moves by 10 px/s, the tolerance of the bench's camera is 0.02 px: 2 ms.
    // After ten edges the loop averages so many that an outlier hardly moves the prediction of the next.
    std::vector<std::int64_t> edges;
    for (int i = 0; i < 12; ++i)
        edges.push_back(20 * ms * i);
    edges[10] += 1'500'000;
    const AheadCounters near = counters_of(SceneTime::clock, edges, false);
    CHECK(near.used == 9);
    CHECK(near.discarded == 0);
    edges[10] += 1'000'000;
    const AheadCounters far = counters_of(SceneTime::clock, edges, false);
    CHECK(far.used == 8);
    CHECK(far.discarded == 1);
    // A scene of nominal times shows the same whenever the edge comes.
    const AheadCounters nominal = counters_of(SceneTime::nominal, {0, 20 * ms, 47 * ms, 60 * ms}, false);
    CHECK(nominal.used == 4);
}

TEST_CASE("newer poses of a simulator confirm a frame within the tolerance only") {
    MakerBench bench(small_sensor(), band_rows, RendersOn::own_thread_live);
    const std::uint32_t blocks = blocks_of(bench.sensor);
    std::uint64_t id = 1;
    // The poses when rendering begins, while it goes on, and at the edge: whether it begins anew, and the
    // error.
    const auto made_anew = [&](double before_px, double during_px, double at_edge_px, double* error_px) {
        const FrameOrder order = order_for(bench, ++id);
        const std::uint32_t bands = render_gate().bands;
        live_px = before_px;
        {
            const ClosedGate closed;
            bench.maker.render_ahead({.order = order, .tolerance_px = 0.02});
            render_gate().wait_for_render();
            live_px = during_px;
        }
        wait_rendered(bands, blocks);
        wait_expected(bench.maker);
        live_px = at_edge_px;
        FrameWork work;
        const FrameRef frame = bench.pool.acquire();
        REQUIRE(bench.maker.prepare(order, *frame).empty());
        REQUIRE(bench.maker.fill(*frame, nullptr, nullptr, &work));
        if (error_px != nullptr) *error_px = work.ahead_error_px;
        return render_gate().bands - bands > blocks;
    };
    double error_px = -1;
    CHECK_FALSE(made_anew(0, 0, 0, &error_px));
    CHECK(error_px == 0);
    CHECK_FALSE(made_anew(1, 1.005, 1.015, &error_px));
    CHECK_THAT(error_px, Catch::Matchers::WithinAbs(0.015, 1e-9));
    CHECK(made_anew(1, 1, 1.03, nullptr));
    CHECK_FALSE(made_anew(1, 1.03, 1.015, nullptr));
    CHECK(made_anew(1, 1.05, 1.015, nullptr)); // astray while the last rows were rendered
    CHECK(made_anew(5, 1, 1, nullptr));        // or before the first
    CHECK(bench.maker.ahead_counters().discarded == 3);
    live_px = 0;
}

TEST_CASE("with automatic exposure the next frame is rendered once this one has been measured") {
    for (const ExposureAuto mode : {ExposureAuto::continuous, ExposureAuto::once}) {
        const AheadCounters counters =
            counters_of(SceneTime::nominal, {0, 20 * ms, 40 * ms, 60 * ms, 80 * ms}, true,
                        [mode](CameraSettings& s) { s.exposure_auto = mode; });
        CHECK(counters.begun >= 5); // the sixth may be begun after the end
        CHECK(counters.used == 5);
        CHECK(counters.discarded == 0);
    }
}

TEST_CASE("edges before the acquisition let its first frame be rendered before its edge") {
    for (const bool source_knows : {false, true}) {
        // The camera's clock stands at the last edge: the acquisition starts between two, however busy the
        // machine is.
        FakeClock clock(MonotonicClock().now());
        CameraBench bench(small_sensor(), 1, {}, sync::OverTrigger::count, LatePolicy::late, false,
                          {.mode = SceneTime::clock}, RendersOn::own_thread, &clock);
        const Time first = clock.now() + 5 * ms;
        std::uint32_t frames = 0;
        for (int i = 0; i < 8; ++i) {
            const Time edge = first + i * 20 * ms;
            if (i == 4) REQUIRE(bench.camera.acquisition_start());
            if (i >= 4) bench.wait_ready();
            clock.advance_to(edge);
            sync::Trigger trigger{static_cast<std::uint64_t>(i) + 1, edge, edge};
            if (source_knows) trigger.next = edge + 20 * ms;
            bench.camera.on_trigger(trigger);
            if (i >= 4) bench.wait_ended(++frames);
        }
        bench.camera.acquisition_stop(false);
        CHECK(bench.camera.counters().frames == 4);
        CHECK(bench.camera.counters().ahead.used == 4);
        CHECK(bench.camera.counters().ahead.discarded == 0);
    }
}

TEST_CASE("a free run that follows the clock has its first frame rendered before its edge") {
    CameraBench bench(
        small_sensor(), 1,
        [](CameraSettings& s) {
            s.frame_trigger.enabled = false;
            s.frame_rate_enabled = true;
            s.frame_rate_hz = 2; // an edge is lost if the machine does not run its thread for so long
        },
        sync::OverTrigger::count, LatePolicy::late, false, {.mode = SceneTime::clock}, RendersOn::own_thread);
    REQUIRE(bench.camera.acquisition_start());
    bench.wait_ended(2);
    bench.camera.acquisition_stop(false);
    const CameraCounters counters = bench.camera.counters();
    CHECK(counters.ahead.used == counters.frames);
    CHECK(counters.ahead.discarded == 0);
}

TEST_CASE("nothing is expected when no frame follows") {
    const std::vector<std::int64_t> edges{0, 20 * ms, 40 * ms};
    CHECK(counters_of(SceneTime::nominal, edges, false).begun == 4);
    CHECK(counters_of(SceneTime::nominal, edges, true, [](CameraSettings& s) {
              s.acquisition_mode = AcquisitionMode::multi_frame;
              s.acquisition_frame_count = 3;
          }).begun == 3);
}

TEST_CASE("a lamp whose light has moved by more than the tolerance has its frame rendered anew") {
    MakerBench bench(small_sensor(), band_rows, RendersOn::own_thread_live);
    scene::Scene scene;
    scene.lamps.emplace_back();
    const renderer::Renderer lit(scene, {});
    bench.maker.replace_renderer(lit);
    const std::uint32_t blocks = blocks_of(bench.sensor);
    std::uint64_t id = 1;
    for (const double moved_px : {0.0, 0.015, 0.03, 2.0}) {
        lamp_px = 0;
        const FrameOrder order = order_for(bench, ++id);
        const std::uint32_t bands = render_gate().bands;
        bench.maker.render_ahead({.order = order, .tolerance_px = 0.02});
        wait_rendered(bands, blocks);
        wait_expected(bench.maker);
        lamp_px = moved_px;
        FrameWork work;
        const FrameRef frame = bench.pool.acquire();
        REQUIRE(bench.maker.prepare(order, *frame).empty());
        REQUIRE(bench.maker.fill(*frame, nullptr, nullptr, &work));
        const bool stands = moved_px <= 0.02;
        CHECK(render_gate().bands - bands == (stands ? blocks : 2 * blocks));
        CHECK_THAT(work.ahead_error_px, Catch::Matchers::WithinAbs(stands ? moved_px : 0, 1e-9));
    }
    CHECK(bench.maker.ahead_counters().used == 2);
    CHECK(bench.maker.ahead_counters().discarded == 2);
    lamp_px = 0;
}

TEST_CASE(
    "a frame begins no earlier before its edge than asked, and shows the poses that have come by then") {
    FakeClock clock;
    MakerBench bench(small_sensor(), band_rows, RendersOn::own_thread_live, &clock);
    const std::uint32_t blocks = blocks_of(bench.sensor);
    FrameOrder order = order_for(bench, 2);
    const Time edge = clock.now() + 100 * ms;
    const ExpectedFrame expected{.order = order, .edge = edge, .tolerance_px = 0.02, .max_ahead_ns = 30 * ms};
    const std::uint32_t before = render_gate().bands;
    live_px = 1;
    bench.maker.render_ahead(expected);
    clock.advance_to(edge - 31 * ms);
    std::this_thread::sleep_for(std::chrono::milliseconds(50)); // one that is begun has time to show it
    CHECK(render_gate().bands == before);
    CHECK(bench.maker.ahead_counters().begun == 0);
    live_px = 5; // a pose that comes late, but in time
    clock.advance_to(edge - 30 * ms);
    wait_rendered(before, blocks);
    wait_expected(bench.maker);
    FrameWork work;
    FrameRef frame = bench.pool.acquire();
    order.trigger_edge = edge;
    REQUIRE(bench.maker.prepare(order, *frame).empty());
    REQUIRE(bench.maker.fill(*frame, nullptr, nullptr, &work));
    CHECK(work.ahead_error_px == 0);
    CHECK(bench.maker.ahead_counters().used == 1);
    CHECK(bench.maker.ahead_counters().begun == 1);

    // An edge that comes before: its frame had not begun, and is rendered now.
    FrameOrder early = order_for(bench, 3);
    bench.maker.render_ahead({.order = early, .edge = clock.now() + 100 * ms, .max_ahead_ns = 30 * ms});
    frame = bench.pool.acquire();
    REQUIRE(bench.maker.make(early, *frame).empty());
    CHECK(render_gate().bands - before == 2 * blocks);
    const AheadCounters counters = bench.maker.ahead_counters();
    CHECK(counters.begun == 1);
    CHECK(counters.used == 1);
    CHECK(counters.discarded == 0);
    // One that never comes leaves nothing behind.
    bench.maker.render_ahead(
        {.order = order_for(bench, 4), .edge = clock.now() + 100 * ms, .max_ahead_ns = 30 * ms});
    bench.maker.forget_expected();
    live_px = 0;
}

TEST_CASE("an acquisition that ends leaves no rendering behind") {
    CameraBench bench(small_sensor(), 6, {}, sync::OverTrigger::count, LatePolicy::late, false, {},
                      RendersOn::own_thread);
    for (int round = 0; round < 20; ++round) {
        render_gate().close();
        REQUIRE(bench.camera.acquisition_start());
        render_gate().wait_for_render();
        bench.camera.acquisition_stop(round % 2 == 0); // returns although nothing renders
        render_gate().open();
    }
    REQUIRE(bench.camera.acquisition_start());
    const Time now = bench.clock.now();
    bench.wait_ready();
    bench.camera.on_trigger({1, now, now});
    bench.wait_ended(1);
    CHECK(bench.camera.counters().frames == 1);
}

} // namespace render_ahead_test
