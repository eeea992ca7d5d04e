// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/camera.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

namespace camera_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

sync::Trigger edge_now(const CameraBench& bench, std::uint64_t id) {
    const Time now = bench.clock.now();
    return {id, now, now};
}

// Every edge is accounted for, once.
void check_balance(const CameraCounters& c) {
    CHECK(c.triggers == c.frames + c.missed_triggers + c.masked_triggers + c.dropped);
    CHECK(c.frames >= c.complete + c.abandoned);
}

} // namespace

TEST_CASE("one edge, one frame, and the frame is what the maker makes offline") {
    CameraBench bench;
    CHECK_FALSE(bench.camera.acquiring());
    REQUIRE(bench.camera.acquisition_start());
    CHECK_FALSE(bench.camera.acquisition_start());
    std::vector<Time> edges;
    for (std::uint64_t id = 1; id <= 5; ++id) {
        bench.wait_ready();
        const sync::Trigger t = edge_now(bench, id);
        edges.push_back(t.edge);
        bench.camera.on_trigger(t);
        bench.wait_ended(static_cast<std::uint32_t>(id));
    }
    bench.camera.acquisition_stop(false);
    bench.releaser.wait_idle();
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 5);

    MakerBench offline;
    for (std::uint64_t id = 1; id <= 5; ++id) {
        const Frame& frame = *kept[id - 1];
        CHECK(frame.info.frame_id == id);
        CHECK(frame.info.trigger_edge == edges[id - 1]);
        FrameOrder order;
        order.frame_id = id;
        order.settings = bench.camera.settings();
        order.scene_time = nominal_scene_time(order.settings, {10, 1}, id);
        CHECK(order.scene_time.ns == static_cast<std::int64_t>(id - 1) * 100 * ns_per_ms);
        const FrameRef again = offline.pool.acquire();
        REQUIRE(offline.maker.make(order, *again).empty());
        CHECK(std::equal(again->pixels().begin(), again->pixels().end(), frame.pixels().begin()));
    }
    const CameraCounters c = bench.camera.counters();
    CHECK(c.triggers == 5);
    CHECK(c.frames == 5);
    CHECK(c.complete == 5);
    CHECK(c.missed_triggers == 0);
    check_balance(c);
}

TEST_CASE("an edge during rendering is counted as missed and makes no frame") {
    CameraBench bench;
    REQUIRE(bench.camera.acquisition_start());
    render_gate().close();
    bench.camera.on_trigger(edge_now(bench, 1));
    render_gate().wait_for_render();
    for (std::uint64_t id = 2; id <= 4; ++id)
        bench.camera.on_trigger(edge_now(bench, id));
    CHECK(bench.camera.counters().missed_triggers == 3);
    render_gate().open();
    bench.wait_ended(1);
    bench.wait_ready();
    bench.camera.on_trigger(edge_now(bench, 5));
    bench.wait_ended(2);
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 2);
    CHECK(kept[1]->info.frame_id == 2); // missed edges take no number
    CHECK(kept[1]->info.trigger_id == 5);
    const CameraCounters c = bench.camera.counters();
    CHECK(c.triggers == 5);
    CHECK(c.missed_triggers == 3);
    check_balance(c);
}

TEST_CASE("an edge sooner than the chip's frame period is missed however fast the rendering is") {
    CameraBench bench;
    REQUIRE(bench.camera.acquisition_start());
    const Time first = bench.clock.now();
    bench.camera.on_trigger({1, first, first});
    bench.wait_ended(1);
    bench.wait_ready();
    const std::int64_t period = bench.maker.plan().frame_period_ns;
    bench.camera.on_trigger({2, first + period - 1, first});
    CHECK(bench.camera.counters().missed_triggers == 1);
    bench.camera.on_trigger({3, first + period, first});
    bench.wait_ended(2);
    CHECK(bench.camera.counters().frames == 2);
    check_balance(bench.camera.counters());
}

TEST_CASE("edges that the source lost are counted through the gap in its ids") {
    CameraBench bench;
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.on_trigger(edge_now(bench, 41)); // no predecessor: nothing can be said about earlier ones
    bench.wait_ended(1);
    bench.wait_ready();
    bench.camera.on_trigger(edge_now(bench, 45));
    bench.wait_ended(2);
    const CameraCounters c = bench.camera.counters();
    CHECK(c.triggers == 5);
    CHECK(c.missed_triggers == 3);
    CHECK(c.frames == 2);
}

TEST_CASE("edges count only while acquiring and from the chosen source") {
    CameraBench bench;
    bench.camera.on_trigger(edge_now(bench, 1));
    CHECK_FALSE(bench.camera.software_trigger(bench.clock.now()));
    REQUIRE(bench.camera.acquisition_start());
    CHECK_FALSE(bench.camera.software_trigger(bench.clock.now()));
    CameraSettings s = bench.camera.settings();
    s.frame_trigger.source = TriggerSource::software;
    REQUIRE(bench.camera.apply(s));
    bench.camera.on_trigger(edge_now(bench, 2));
    CHECK(bench.camera.counters().triggers == 0);
    CHECK(bench.camera.counters().ignored == 4);
    CHECK_FALSE(bench.camera.action_trigger(bench.clock.now()));
    CHECK(bench.camera.software_trigger(bench.clock.now()));
    bench.wait_ended(1);
    CHECK(bench.camera.counters().frames == 1);
    s.frame_trigger.source = TriggerSource::action1;
    REQUIRE(bench.camera.apply(s));
    bench.wait_ready();
    CHECK_FALSE(bench.camera.software_trigger(bench.clock.now()));
    REQUIRE(bench.camera.action_trigger(bench.clock.now()));
    bench.wait_ended(2);
    CHECK(bench.camera.counters().frames == 2);
}

TEST_CASE("settings outside the limits change nothing; good ones hold from the next frame on") {
    CameraBench bench;
    const CameraSettings before = bench.camera.settings();
    CameraSettings s = before;
    s.region = {0, 0, 41, 30};
    CHECK_FALSE(bench.camera.apply(s));
    CHECK(bench.camera.settings() == before);
    s.region = {4, 2, 20, 10};
    s.exposure_ns = 55 * ns_per_us;
    s.pixel_format = PixelFormat::mono8;
    REQUIRE(bench.camera.apply(s));
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.on_trigger(edge_now(bench, 1));
    bench.wait_ended(1);
    bench.loopback.stop();
    REQUIRE(bench.loopback.kept().size() == 1);
    const FrameInfo& info = bench.loopback.kept()[0]->info;
    CHECK(info.width == 20);
    CHECK(info.height == 10);
    CHECK(info.exposure_ns == 55 * ns_per_us);
    CHECK(info.windows[0].sensor == Region{4, 2, 20, 10});
    CHECK(info.pixel_format == PixelFormat::mono8);
}

TEST_CASE("new settings hold from the next frame on, however many read them") {
    CameraBench bench(small_sensor(), 0);
    std::int64_t exposure_ns = 0;
    std::atomic<std::uint64_t> last_id{0};
    transports::LoopbackTransport last({4, 0, [&](const FrameRef& frame) {
                                            exposure_ns = frame->info.exposure_ns;
                                            last_id = frame->info.frame_id;
                                        }});
    bench.camera.add_transport(last);
    last.start();
    std::atomic<bool> stop{false};
    std::vector<std::thread> readers;
    for (int i = 0; i < 3; ++i)
        readers.emplace_back([&] {
            while (!stop)
                (void)bench.camera.settings();
        });
    REQUIRE(bench.camera.acquisition_start());
    int old = 0;
    for (std::uint64_t id = 1; id <= 200; ++id) {
        CameraSettings settings = bench.camera.settings();
        settings.exposure_ns = 50'000 + static_cast<std::int64_t>(id) * 100;
        bench.wait_ready();
        REQUIRE(bench.camera.apply(settings));
        bench.camera.on_trigger(edge_now(bench, id));
        bench.wait_ended(static_cast<std::uint32_t>(id));
        while (last_id != id)
            std::this_thread::yield();
        old += exposure_ns != settings.exposure_ns;
    }
    stop = true;
    for (std::thread& reader : readers)
        reader.join();
    bench.camera.acquisition_stop(true);
    last.stop();
    CHECK(old == 0);
}

TEST_CASE("single and multi frame acquisitions end by themselves, and numbers restart at 1") {
    CameraBench bench(small_sensor(), 8);
    CameraSettings s = bench.camera.settings();
    s.acquisition_mode = AcquisitionMode::multi_frame;
    s.acquisition_frame_count = 2;
    REQUIRE(bench.camera.apply(s));
    std::uint32_t ended = 0;
    for (int round = 0; round < 2; ++round) {
        REQUIRE(bench.camera.acquisition_start());
        for (std::uint64_t id = 1; id <= 2; ++id) {
            bench.wait_ready();
            bench.camera.on_trigger(edge_now(bench, id));
            bench.wait_ended(++ended);
        }
        CHECK_FALSE(bench.camera.acquiring());
        bench.camera.on_trigger(edge_now(bench, 3));
    }
    s.acquisition_mode = AcquisitionMode::single_frame;
    REQUIRE(bench.camera.apply(s));
    REQUIRE(bench.camera.acquisition_start());
    bench.wait_ready(); // the pipeline may not be through with the frame before
    bench.camera.on_trigger(edge_now(bench, 9));
    bench.wait_ended(++ended);
    CHECK_FALSE(bench.camera.acquiring());
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 5);
    const std::uint64_t expected[] = {1, 2, 1, 2, 1};
    for (std::size_t i = 0; i < 5; ++i)
        CHECK(kept[i]->info.frame_id == expected[i]);
    CHECK(bench.camera.counters().ignored == 2);
}

TEST_CASE("stopping with abort gives up the frame in work, and the next acquisition is whole") {
    CameraBench bench;
    REQUIRE(bench.camera.acquisition_start());
    render_gate().close();
    bench.camera.on_trigger(edge_now(bench, 1));
    render_gate().wait_for_render();
    bench.camera.acquisition_stop(true);
    render_gate().open();
    bench.wait_ended(1);
    CHECK(bench.camera.counters().abandoned == 1);
    CHECK(bench.camera.counters().complete == 0);
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.on_trigger(edge_now(bench, 2));
    bench.wait_ended(2);
    bench.releaser.wait_idle();
    CHECK(bench.camera.counters().complete == 1);
    check_balance(bench.camera.counters());
}

TEST_CASE("stopping without abort lets the frame in work finish") {
    CameraBench bench;
    REQUIRE(bench.camera.acquisition_start());
    render_gate().close();
    bench.camera.on_trigger(edge_now(bench, 1));
    render_gate().wait_for_render();
    bench.camera.acquisition_stop(false); // returns while the frame is still being rendered
    CHECK_FALSE(bench.camera.acquiring());
    render_gate().open();
    bench.wait_ended(1);
    bench.releaser.wait_idle();
    CHECK(bench.camera.counters().complete == 1);
}

TEST_CASE("an abort does not wait for the end of a long exposure") {
    CameraBench bench(small_sensor(), 5, [](CameraSettings& s) { s.exposure_ns = 10 * ns_per_s; });
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.on_trigger(edge_now(bench, 1));
    bench.wait_ready(); // rendered, and now the rows wait for the end of their exposure
    CHECK(bench.ended == 0);
    bench.camera.acquisition_stop(true);
    bench.wait_ended(1);
    CHECK(bench.camera.counters().abandoned == 1);
}

TEST_CASE("an edge that comes too soon can be latched and takes effect when the chip is free again") {
    CameraBench bench(small_sensor(), 5, {}, sync::OverTrigger::latch);
    REQUIRE(bench.camera.acquisition_start());
    render_gate().close();
    const Time first = bench.clock.now();
    bench.camera.on_trigger({1, first, first});
    render_gate().wait_for_render();
    bench.camera.on_trigger({2, first + 1000, first});
    bench.camera.on_trigger({3, first + 2000, first}); // there is room for one
    render_gate().open();
    bench.wait_ended(2);
    bench.wait_ready();
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 2);
    CHECK(kept[1]->info.trigger_edge == first + 1000);
    CHECK(kept[1]->row_times()[0].reset == first + bench.maker.plan().frame_period_ns);
    const CameraCounters c = bench.camera.counters();
    CHECK(c.latched_triggers == 1);
    CHECK(c.missed_triggers == 1);
    check_balance(c);
}

TEST_CASE("an empty pool drops the frame, says so, and uses up its number") {
    CameraBench bench;
    std::vector<FrameRef> hold;
    while (FrameRef frame = bench.pool.acquire())
        hold.push_back(std::move(frame));
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.on_trigger(edge_now(bench, 1));
    bench.wait_ready();
    hold.clear();
    bench.camera.on_trigger(edge_now(bench, 2));
    bench.wait_ended(1);
    bench.loopback.stop();
    REQUIRE(bench.loopback.kept().size() == 1);
    CHECK(bench.loopback.kept()[0]->info.frame_id == 2);
    const CameraCounters c = bench.camera.counters();
    CHECK(c.dropped == 1);
    check_balance(c);
    CHECK(bench.log.drain() == 1);
}

TEST_CASE("in free run the camera ticks by itself, at the rate asked for") {
    CameraBench bench(small_sensor(), 4, [](CameraSettings& s) {
        s.frame_trigger.enabled = false;
        s.frame_rate_hz = 200;
    });
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.on_trigger(edge_now(bench, 1)); // Line0 does not matter now
    bench.wait_ended(4);
    bench.camera.acquisition_stop(false);
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 4);
    for (std::size_t i = 1; i < 4; ++i) {
        const std::int64_t span = kept[i]->info.trigger_edge - kept[i - 1]->info.trigger_edge;
        CHECK(span % (5 * ns_per_ms) == 0); // multiples, should an edge have been missed on a busy machine
        CHECK(kept[i]->info.frame_id == kept[i - 1]->info.frame_id + 1);
    }
    check_balance(bench.camera.counters());
}

TEST_CASE("no row leaves before its time, and rows that are not ready in time are counted") {
    CameraBench bench(small_sensor(), 5, [](CameraSettings& s) { s.exposure_ns = 30 * ns_per_ms; });
    REQUIRE(bench.camera.acquisition_start());
    const sync::Trigger edge = edge_now(bench, 1);
    bench.camera.on_trigger(edge);
    bench.wait_ended(1);
    CHECK(bench.clock.now() - edge.edge >= 30 * ns_per_ms);
    bench.releaser.wait_idle();
    CHECK(bench.releaser.trigger_to_first_row().max_ns() >= 30 * ns_per_ms);

    bench.wait_ready();
    render_gate().close();
    const Time now = bench.clock.now();
    bench.camera.on_trigger({2, now, now});
    render_gate().wait_for_render();
    while (bench.clock.now() - now < 32 * ns_per_ms)
        std::this_thread::yield();
    render_gate().open();
    bench.wait_ended(2);
    bench.releaser.wait_idle();
    bench.loopback.stop();
    REQUIRE(bench.loopback.kept().size() == 2);
    CHECK((bench.loopback.kept()[1]->flags.load() & frame_late) != 0);
    const CameraCounters c = bench.camera.counters();
    CHECK(c.late >= 1);
    CHECK(c.late_rows >= 30);
}

TEST_CASE("what happens to a frame that is not ready in time is the policy's") {
    const LatePolicy policy = GENERATE(LatePolicy::repeat, LatePolicy::drop, LatePolicy::partial);
    CameraBench bench(
        small_sensor(), 5, [](CameraSettings& s) { s.exposure_ns = 20 * ns_per_ms; },
        sync::OverTrigger::count, policy);
    std::vector<std::vector<std::uint16_t>> pictures;
    std::vector<std::uint32_t> flags;
    std::vector<std::int32_t> rows;
    std::atomic<int> noted{0};
    transports::LoopbackTransport notes({4, 0, [&](const FrameRef& f) {
                                             pictures.emplace_back(f->pixels().begin(), f->pixels().end());
                                             flags.push_back(f->flags.load());
                                             rows.push_back(f->rows_ready());
                                             ++noted;
                                             noted.notify_all();
                                         }});
    bench.camera.add_transport(notes);
    notes.start();
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.on_trigger(edge_now(bench, 1)); // in time
    bench.wait_ended(1);
    bench.wait_ready();
    render_gate().close();
    bench.camera.on_trigger(edge_now(bench, 2)); // never ready: the gate opens only when it is given up
    bench.wait_ended(policy == LatePolicy::repeat ? 1 : 2);
    if (policy == LatePolicy::repeat) bench.wait_ended(2);
    render_gate().open();
    bench.wait_ready();
    bench.camera.on_trigger(edge_now(bench, 3)); // and the next one is in time again
    bench.wait_ended(3);
    for (int seen = noted; seen < 3; seen = noted)
        noted.wait(seen);
    bench.releaser.wait_idle();
    notes.stop();

    const ReleaseCounters c = bench.releaser.counters();
    CHECK(c.complete + c.abandoned == 3);
    CHECK((flags[1] & frame_late) != 0);
    if (policy == LatePolicy::repeat) {
        CHECK(c.repeated >= 1);
        CHECK((flags[1] & frame_repeated) != 0);
        CHECK(rows[1] == 30);
        CHECK((pictures[1] == pictures[0]));
    } else {
        CHECK(rows[1] == 0);
        CHECK((flags[1] & frame_partial) != 0);
        CHECK(((flags[1] & frame_dropped) != 0) == (policy == LatePolicy::drop));
        CHECK((policy == LatePolicy::drop ? c.dropped : c.partial) >= 1);
    }
    check_balance(bench.camera.counters());

    // Every frame left its line in the timing report.
    std::ostringstream report;
    CHECK(bench.timing.drain(report) == 3);
    const std::string text = report.str();
    CHECK(std::count(text.begin(), text.end(), '\n') == 3);
    CHECK(text.substr(0, 4) == "1,1,");
    const std::string header = bench.timing.header();
    CHECK_THAT(header, Catch::Matchers::ContainsSubstring(
                           ",loopback_first_byte_ns,loopback_last_byte_ns,loopback_pace_ns,row_"));
    CHECK(std::count(header.begin(), header.end(), ',') * 3 == std::count(text.begin(), text.end(), ','));
}

TEST_CASE("the camera is alive when idle and while bands move, and not when one hangs") {
    CameraBench bench;
    CHECK(bench.camera.alive());
    CHECK(bench.camera.alive());
    REQUIRE(bench.camera.acquisition_start());
    render_gate().close();
    bench.camera.on_trigger(edge_now(bench, 1));
    render_gate().wait_for_render();
    (void)bench.camera.alive();
    CHECK_FALSE(bench.camera.alive());
    render_gate().open();
    bench.wait_ended(1);
    bench.wait_ready();
    CHECK(bench.camera.alive());
}

TEST_CASE("a trigger divider lets the first of so many edges through, and the others are not missed") {
    CameraBench bench(small_sensor(), 8, [](CameraSettings& s) { s.trigger_divider = 3; });
    REQUIRE(bench.camera.acquisition_start());
    std::vector<Time> edges;
    for (std::uint64_t id = 11; id < 18; ++id) {
        bench.wait_ready();
        const sync::Trigger t = edge_now(bench, id);
        edges.push_back(t.edge);
        bench.camera.on_trigger(t);
        bench.wait_ended(static_cast<std::uint32_t>((id - 11) / 3 + 1));
    }
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 3);
    for (std::size_t i = 0; i < 3; ++i) {
        CHECK(kept[i]->info.trigger_edge == edges[3 * i]);
        CHECK(kept[i]->info.line_status == line_status_line0);
    }
    CHECK(bench.camera.counters().missed_triggers == 0);
    const CameraActivity a = bench.camera.activity();
    CHECK(a.lines[0].edges == 7);
    CHECK(a.lines[0].edge == edges.back());
    CHECK(a.frames == 3);
    CHECK(a.frame_start == edges[6]);
    CHECK(a.exposure_start >= a.frame_start);
    CHECK(a.exposure_end > a.exposure_start);
    CHECK(a.frame_end >= a.exposure_end);
}

TEST_CASE("edges of the activation count, and those of the other kind are not missed") {
    const auto frames_of = [](TriggerActivation activation) {
        CameraBench bench(
            small_sensor(), 8, [&](CameraSettings& s) { s.frame_trigger.activation = activation; },
            sync::OverTrigger::count, LatePolicy::late, true);
        REQUIRE(bench.camera.acquisition_start());
        std::uint32_t expected = 0;
        for (std::uint64_t id = 1; id <= 6; ++id) {
            sync::Trigger t = edge_now(bench, id);
            t.falling = id % 2 == 0;
            bench.wait_ready();
            bench.camera.on_trigger(t);
            expected += activates(activation, t.falling) ? 1 : 0;
            bench.wait_ended(expected);
        }
        bench.wait_ready();
        CHECK(bench.camera.counters().missed_triggers == 0);
        // Four edges lost: two of them would have counted.
        if (activation != TriggerActivation::any_edge) {
            sync::Trigger t = edge_now(bench, 11);
            t.falling = activation == TriggerActivation::falling_edge;
            bench.camera.on_trigger(t);
            CHECK(bench.camera.counters().missed_triggers == 2);
            bench.wait_ended(expected + 1);
        }
        CHECK(bench.camera.activity().lines[0].edges >= 6);
        check_balance(bench.camera.counters());
        return expected;
    };
    CHECK(frames_of(TriggerActivation::rising_edge) == 3);
    CHECK(frames_of(TriggerActivation::falling_edge) == 3);
    CHECK(frames_of(TriggerActivation::any_edge) == 6);

    const CameraLimits rising_only = CameraBench().camera.limits();
    CameraSettings s = whole_sensor(small_sensor());
    CHECK(explain_invalid(s, rising_only).empty());
    s.frame_trigger.activation = TriggerActivation::any_edge;
    CHECK(explain_invalid(s, rising_only) ==
          "TriggerActivation[FrameStart]: Line0 reports rising edges only");
    s.frame_trigger.activation = TriggerActivation::falling_edge;
    CHECK_FALSE(explain_invalid(s, rising_only).empty());
}

TEST_CASE("an acquisition that waits for its own trigger takes no frame before") {
    CameraBench bench(
        small_sensor(), 8,
        [](CameraSettings& s) {
            s.start_trigger.enabled = true;
            s.start_trigger.activation = TriggerActivation::falling_edge;
        },
        sync::OverTrigger::count, LatePolicy::late, true);
    for (int round = 0; round < 2; ++round) { // anew in each acquisition
        const std::uint64_t ended = bench.ended;
        REQUIRE(bench.camera.acquisition_start());
        CHECK(bench.camera.acquiring());
        CHECK(bench.camera.activity().start_awaited);
        CHECK_FALSE(bench.camera.trigger_ready());
        CHECK_FALSE(bench.camera.software_start_trigger(bench.clock.now())); // another source
        sync::Trigger t = edge_now(bench, 1);
        bench.camera.on_trigger(t); // rising
        CHECK(bench.camera.activity().start_awaited);
        t = edge_now(bench, 2);
        t.falling = true;
        bench.camera.on_trigger(t); // starts, and makes no frame
        CHECK_FALSE(bench.camera.activity().start_awaited);
        bench.wait_ready();
        t = edge_now(bench, 3);
        bench.camera.on_trigger(t);
        bench.wait_ended(static_cast<std::uint32_t>(ended + 1));
        bench.camera.acquisition_stop(false);
    }
    bench.releaser.wait_idle();
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 2);
    CHECK(kept[0]->info.frame_id == 1);
    CHECK(kept[1]->info.frame_id == 1);
    CHECK(bench.camera.counters().missed_triggers == 0);

    CameraBench free(small_sensor(), 8, [](CameraSettings& s) {
        s.start_trigger.enabled = true;
        s.start_trigger.source = TriggerSource::action1;
        s.frame_trigger.enabled = false;
        s.frame_rate_hz = 200;
    });
    REQUIRE(free.camera.acquisition_start());
    std::this_thread::sleep_for(std::chrono::milliseconds(30)); // some ticks
    CHECK(free.camera.counters().frames == 0);
    CHECK(free.camera.action_trigger(free.clock.now()));
    free.wait_ended(3);
    CHECK(free.camera.counters().missed_triggers <= free.camera.counters().triggers);
    free.camera.acquisition_stop(false);
}

TEST_CASE("the sequencer changes settings from frame to frame, and starts anew with each acquisition") {
    CameraBench bench(small_sensor(), 8, [](CameraSettings& s) {
        s.region = {0, 0, 20, 10};
        s.gain_db = 1;
    });
    Sequence sequence;
    sequence.enabled = true;
    sequence.features = sequenced_exposure | sequenced_offset_x;
    sequence.start = 4;
    sequence.steps[4] = {50'000, 9, 0, 3, 0, 5};
    sequence.steps[5] = {70'000, 9, 0, 7, 0, 5};
    sequence.steps[5].exposure_ns = 0;
    CHECK_FALSE(bench.camera.set_sequence(sequence));
    sequence.steps[5].exposure_ns = 70'000;
    REQUIRE(bench.camera.set_sequence(sequence));
    std::uint32_t ended = 0;
    for (int round = 0; round < 2; ++round) {
        REQUIRE(bench.camera.acquisition_start());
        CHECK_FALSE(bench.camera.set_sequence(sequence)); // not while acquiring
        for (std::uint64_t id = 1; id <= 3; ++id) {
            bench.wait_ready();
            bench.camera.on_trigger(edge_now(bench, id));
            bench.wait_ended(++ended);
        }
        bench.camera.acquisition_stop(false);
    }
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 6);
    for (std::size_t i = 0; i < 6; ++i) {
        const bool first = i % 3 == 0;
        CHECK(kept[i]->info.sequence_step == (first ? 4 : 5));
        CHECK(kept[i]->info.exposure_ns == (first ? 50'000 : 70'000));
        CHECK(kept[i]->info.windows[0].sensor.x == (first ? 3 : 7));
        CHECK(kept[i]->info.gain_db == 1); // not a sequenced feature
    }
    CHECK(bench.camera.activity().sequence_step == 5);
}

TEST_CASE("without a frame rate the free run is as fast as the chip") {
    CameraBench bench(small_sensor(), 8, [](CameraSettings& s) {
        s.frame_trigger.enabled = false;
        s.frame_rate_hz = 0.01;
        s.frame_rate_enabled = false;
        s.exposure_ns = 5 * ns_per_ms;
    });
    REQUIRE(bench.camera.acquisition_start()); // at 0.01 Hz the second frame would take 100 s
    bench.wait_ended(2);
    bench.camera.acquisition_stop(true);
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() >= 2);
    const std::int64_t period = bench.camera.readout(bench.camera.settings()).frame_period_ns;
    CHECK(kept[1]->info.trigger_edge - kept[0]->info.trigger_edge >= period);
}

TEST_CASE("exposure auto goes where the frames before say, the same way every time") {
    std::vector<std::int64_t> first_run;
    for (int run = 0; run < 2; ++run) {
        CameraBench bench(small_sensor(), 6, [](CameraSettings& s) {
            s.exposure_ns = 20 * ns_per_us;
            s.exposure_auto = ExposureAuto::continuous;
            s.auto_target_percent = 60;
            s.auto_percentile = 90;
            s.test_pattern = ImagePattern::off;
        });
        REQUIRE(bench.camera.acquisition_start());
        for (std::uint32_t id = 1; id <= 6; ++id) {
            bench.wait_ready();
            bench.camera.on_trigger(edge_now(bench, id));
            bench.wait_ended(id);
        }
        bench.wait_ready();
        const CameraSettings shown = bench.camera.settings();
        CHECK(shown.exposure_auto == ExposureAuto::continuous);
        bench.camera.acquisition_stop(false);
        bench.loopback.stop();
        const std::vector<FrameRef> kept = bench.loopback.kept();
        REQUIRE(kept.size() == 6);
        std::vector<std::int64_t> exposures;
        for (const FrameRef& frame : kept)
            exposures.push_back(frame->info.exposure_ns);
        CHECK(exposures.front() == 20 * ns_per_us);
        const double black = shown.black_level_dn, white = 4095;
        const auto signal = [&](const Frame& frame) {
            std::vector<std::uint16_t> sorted(frame.pixels().begin(), frame.pixels().end());
            std::sort(sorted.begin(), sorted.end());
            return static_cast<double>(sorted[sorted.size() * 9 / 10 - 1]);
        };
        // Each exposure from the pixels of the frame before, found here by sorting them.
        for (std::size_t k = 1; k <= kept.size(); ++k) {
            CAPTURE(k, exposures);
            const Frame& before = *kept[k - 1];
            const double factor = 0.6 * (white - black) / (signal(before) - black);
            const std::int64_t now = k < kept.size() ? exposures[k] : shown.exposure_ns;
            const auto obtained = static_cast<double>(before.info.windows[0].exposure_max_ns);
            if (signal(before) < white && factor > 0.25 && factor < 4 && std::abs(factor - 1) > 0.02)
                CHECK(now == std::llround(obtained * factor));
        }
        if (run == 0) first_run = exposures;
        CHECK(exposures == first_run);
    }
}

TEST_CASE("exposure auto once ends by itself and leaves the exposure it found") {
    CameraBench bench(small_sensor(), 1, [](CameraSettings& s) { s.exposure_ns = 5 * ns_per_us; });
    CameraSettings s = bench.camera.settings();
    s.exposure_auto = ExposureAuto::once;
    REQUIRE(bench.camera.apply(s));
    REQUIRE(bench.camera.acquisition_start());
    std::uint32_t id = 0;
    const auto take = [&] {
        bench.wait_ready();
        bench.camera.on_trigger(edge_now(bench, ++id));
        bench.wait_ended(id);
        bench.wait_ready();
    };
    while (bench.camera.settings().exposure_auto == ExposureAuto::once && id < 20)
        take();
    CHECK(id < 20);
    const std::int64_t found = bench.camera.settings().exposure_ns;
    CHECK(found > 5 * ns_per_us);
    take();
    CHECK(bench.camera.settings().exposure_ns == found);
    // Switched on anew it starts from what is set then.
    s = bench.camera.settings();
    CHECK(s.exposure_auto == ExposureAuto::off);
    s.exposure_ns = 2 * found;
    REQUIRE(bench.camera.apply(s));
    s.exposure_auto = ExposureAuto::once;
    REQUIRE(bench.camera.apply(s));
    CHECK(bench.camera.settings().exposure_auto == ExposureAuto::once);
    take();
    CHECK(bench.camera.settings().exposure_ns < 2 * found);
}

TEST_CASE("a burst is so many frames from its trigger on, at the rate of the free run") {
    CameraBench bench(small_sensor(), 6, [](CameraSettings& s) {
        s.frame_trigger.enabled = false;
        s.frame_rate_hz = 200;
        s.burst_trigger = {true, TriggerSource::software, TriggerActivation::rising_edge};
        s.burst_frame_count = 3;
    });
    CHECK_FALSE(bench.camera.software_burst_trigger(bench.clock.now())); // not acquiring
    REQUIRE(bench.camera.acquisition_start());
    bench.clock.sleep_until(bench.clock.now() + 30 * ns_per_ms); // several periods without a frame
    CHECK(bench.camera.counters().frames == 0);
    CHECK_FALSE(bench.camera.trigger_ready());
    const Time first = bench.clock.now();
    REQUIRE(bench.camera.software_burst_trigger(first));
    CHECK_FALSE(bench.camera.software_burst_trigger(first + 1)); // in the middle of it
    CHECK(bench.camera.counters().missed_triggers >= 1);
    bench.wait_ended(3);
    bench.clock.sleep_until(bench.clock.now() + 30 * ns_per_ms);
    CHECK(bench.camera.counters().frames == 3);
    const Time second = bench.clock.now();
    REQUIRE(bench.camera.software_burst_trigger(second));
    bench.wait_ended(6);
    bench.camera.acquisition_stop(true);
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 6);
    // At the trigger itself, and whole periods after it; a period may be skipped on a busy machine.
    CHECK(kept[0]->info.trigger_edge == first);
    for (const std::size_t k : {1U, 2U, 3U, 4U, 5U}) {
        const std::int64_t since = kept[k]->info.trigger_edge - (k < 3 ? first : second);
        CHECK(since % (5 * ns_per_ms) == 0);
        CHECK(since >= static_cast<std::int64_t>(k % 3) * 5 * ns_per_ms);
    }
    check_balance(bench.camera.counters());
}

TEST_CASE("with one line for burst and frames, its first edge begins the burst, the next are its frames") {
    CameraBench bench(small_sensor(), 5, [](CameraSettings& s) {
        s.burst_trigger.enabled = true;
        s.burst_frame_count = 2;
    });
    REQUIRE(bench.camera.acquisition_start());
    std::vector<Time> edges;
    std::uint32_t frames = 0;
    for (std::uint64_t id = 1; id <= 6; ++id) {
        if (id % 3 != 1) bench.wait_ready();
        const sync::Trigger edge = edge_now(bench, id);
        bench.camera.on_trigger(edge);
        if (id % 3 == 1) continue; // the burst's
        edges.push_back(edge.edge);
        bench.wait_ended(++frames);
    }
    bench.camera.acquisition_stop(false);
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 4);
    for (std::size_t k = 0; k < 4; ++k)
        CHECK(kept[k]->info.trigger_edge == edges[k]);
    CHECK(bench.camera.counters().missed_triggers == 0); // the burst's edges were not lost
    check_balance(bench.camera.counters());
}

TEST_CASE("with a trigger for the exposure, that of the frame only readies the camera") {
    CameraBench bench(small_sensor(), 5, [](CameraSettings& s) {
        s.frame_trigger.source = TriggerSource::software;
        s.exposure_trigger = {true, TriggerSource::line0, TriggerActivation::rising_edge};
    });
    REQUIRE(bench.camera.acquisition_start());
    bench.camera.on_trigger(edge_now(bench, 1)); // nothing is ready for it
    CHECK(bench.camera.counters().triggers == 0);
    REQUIRE(bench.camera.software_trigger(bench.clock.now()));
    CHECK_FALSE(bench.camera.software_trigger(bench.clock.now())); // it is ready already
    CHECK(bench.camera.counters().missed_triggers == 1);
    CHECK(bench.camera.counters().frames == 0);
    const sync::Trigger edge = edge_now(bench, 2);
    bench.camera.on_trigger(edge);
    bench.wait_ended(1);
    bench.wait_ready();
    bench.camera.on_trigger(edge_now(bench, 3)); // once only
    CHECK(bench.camera.counters().frames == 1);
    bench.camera.acquisition_stop(false);

    // Without a trigger for frames every edge exposes one.
    CameraSettings s = bench.camera.settings();
    s.frame_trigger.enabled = false;
    s.trigger_divider = 2;
    CHECK_FALSE(bench.camera.apply(s));
    s.trigger_divider = 1;
    REQUIRE(bench.camera.apply(s));
    REQUIRE(bench.camera.acquisition_start());
    for (std::uint32_t n = 2; n <= 3; ++n) {
        bench.wait_ready();
        bench.camera.on_trigger(edge_now(bench, n + 2));
        bench.wait_ended(n);
    }
    bench.camera.acquisition_stop(false);
    bench.loopback.stop();
    const std::vector<FrameRef> kept = bench.loopback.kept();
    REQUIRE(kept.size() == 3);
    CHECK(kept[0]->info.trigger_edge == edge.edge);
    check_balance(bench.camera.counters());
}

} // namespace camera_test
