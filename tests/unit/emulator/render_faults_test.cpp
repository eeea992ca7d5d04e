// SPDX-License-Identifier: Apache-2.0
// What the renderer throws on real-time threads, and poses that are not known for a frame.
#include "core/pose_range.hpp"
#include "emulator/camera/frame_maker.hpp"
#include "emulator/render/pose_ring.hpp"
#include "emulator/simulator/simulator_protocol.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace render_faults_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

FrameOrder order_for(const MakerBench& bench, std::uint64_t id) {
    FrameOrder order;
    order.frame_id = order.trigger_id = id;
    order.trigger_edge = order.seen = bench.clock.now();
    order.scene_time = Time{static_cast<std::int64_t>(id) * 100 * ns_per_ms};
    order.settings = whole_sensor(bench.sensor);
    return order;
}

std::uint32_t flags_of_next(MakerBench& bench, std::uint64_t id,
                            std::vector<std::uint16_t>* pixels = nullptr) {
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bench.maker.make(order_for(bench, id), *frame).empty());
    CHECK(frame->complete());
    if (pixels != nullptr) pixels->assign(frame->pixels().begin(), frame->pixels().end());
    return frame->flags.load();
}

/// The renderer throws while it is open.
struct Throws {
    explicit Throws(std::string what) {
        render_gate().row_work = [text = std::move(what)](QualityLevel) { throw std::runtime_error(text); };
    }
    ~Throws() { render_gate().row_work = {}; }
};

} // namespace

TEST_CASE("what the renderer throws makes a frame black, flagged and counted, and the next one is right") {
    SensorDescription sensor = small_sensor();
    for (const auto& [renders, adapts] : {std::pair(RendersOn::calling_thread, false),
                                          {RendersOn::own_thread, false},
                                          {RendersOn::own_thread, true}}) {
        CAPTURE(static_cast<int>(renders), adapts);
        MakerBench bench(sensor, 8, renders, nullptr, true, adapts);
        std::vector<std::uint16_t> good, black, again, without_light(good);
        CHECK((flags_of_next(bench, 1, &good) & frame_failed) == 0);
        {
            const Throws fault("a pose of 1e200");
            CHECK((flags_of_next(bench, 2, &black) & frame_failed) != 0);
        }
        CHECK(bench.maker.failed_frames() == 1);
        CHECK(bench.maker.faults().take_text() == "a pose of 1e200");
        CHECK(bench.maker.faults().take_text().empty());
        CHECK((flags_of_next(bench, 3, &again) & frame_failed) == 0);
        CHECK(bench.maker.failed_frames() == 1);
        // Without light there is offset and noise only: far below the light of the test renderer.
        CHECK(*std::max_element(black.begin(), black.end()) <
              *std::max_element(good.begin(), good.end()) / 2);
        CHECK(*std::max_element(again.begin(), again.end()) >
              2 * *std::max_element(black.begin(), black.end()));
    }
}

TEST_CASE("what the renderer throws on its thread before the trigger ends nothing") {
    MakerBench bench(small_sensor(), 8, RendersOn::own_thread, nullptr, true);
    CHECK((flags_of_next(bench, 1) & frame_failed) == 0);
    const FrameOrder order = order_for(bench, 2);
    {
        const Throws fault("no light");
        bench.maker.render_ahead({.order = order, .edge = order.trigger_edge});
        while (bench.maker.faults().count() == 0)
            std::this_thread::yield();
        while (!bench.maker.expected_is_ready())
            std::this_thread::yield();
    }
    const FrameRef frame = bench.pool.acquire();
    REQUIRE(bench.maker.make(order, *frame).empty());
    CHECK((frame->flags.load() & frame_failed) != 0);
    CHECK((flags_of_next(bench, 3) & frame_failed) == 0);
}

TEST_CASE("offline, what the renderer throws reaches the caller") {
    MakerBench bench;
    const Throws fault("a file that is gone");
    const FrameRef frame = bench.pool.acquire();
    CHECK_THROWS_AS(bench.maker.make(order_for(bench, 1), *frame), std::runtime_error);
}

TEST_CASE("a frame that shows the last known pose says so and is counted") {
    MakerBench bench;
    CHECK((flags_of_next(bench, 1) & frame_pose_held) == 0);
    pose_age_s = 3.5;
    CHECK((flags_of_next(bench, 2) & frame_pose_held) != 0);
    pose_age_s = 0;
    CHECK((flags_of_next(bench, 3) & frame_pose_held) == 0);
    CHECK(bench.maker.frames_with_held_poses() == 1);
}

TEST_CASE("poses of datagrams, lines and calls have one range") {
    struct Case {
        const char* line;
        bool good;
    };
    for (const Case& c :
         {Case{"pose camera 1 1e15 -1e15 0 1 0 0 0", true},
          Case{"pose camera 1 1.000001e15 0 0 1 0 0 0", false},
          Case{"pose camera 1 0 1e200 0 1 0 0 0", false}, Case{"pose camera 1 0 0 -1e308 1 0 0 0", false},
          Case{"pose camera 1 0 0 0 1e200 0 0 0", false}, Case{"pose camera 1 0 0 0 0 0 0 0", false},
          Case{"pose camera 1 0 0 0 1 0 0 0 1e9 0 0 0 0 1e4", true},
          Case{"pose camera 1 0 0 0 1 0 0 0 1.1e9 0 0 0 0 0", false},
          Case{"pose camera 1 0 0 0 1 0 0 0 0 0 0 0 1.1e4 0", false}}) {
        CAPTURE(c.line);
        CHECK(std::holds_alternative<PoseLine>(parse_simulator_line(c.line)) == c.good);
    }
    // The call `pose`, which HTTP uses as well.
    PoseLine line{.name = "camera", .time = Time{1}, .pose = {{0, 0, 2e15}, {}}};
    CHECK(check_pose(line) == "pose: " + *refusal_of(line.pose));
    line.pose.position_m = {};
    line.rates = {{{2e9, 0, 0}, {}}};
    CHECK(check_pose(line) == "pose: " + *refusal_of_velocity(line.rates->velocity_m_s));
}

TEST_CASE("between poses whose rates do not fit to them positions stay in the range") {
    PoseRing ring(0.1);
    const PoseRates fast{{1e9, 1e9, 0}, {}};
    REQUIRE(ring.push(0, {{1e15, 0, 0}, {}}, fast));
    REQUIRE(ring.push(9e8, {{-1e15, 0, 0}, {}}, fast));
    for (double t = -1e8; t < 1.1e9; t += 1e7) {
        Pose pose;
        REQUIRE(ring.at(t, pose));
        CHECK(length(pose.position_m) < 1.01e15);
    }
}

} // namespace render_faults_test
