// SPDX-License-Identifier: Apache-2.0
// A small camera on the test bench: everything of the pipeline around the test renderer.
#pragma once

#include "emulator/camera/camera.hpp"
#include "emulator/camera/frame_maker.hpp"
#include "emulator/camera/releaser.hpp"
#include "renderer/renderer.hpp"
#include "sensors/sensor.hpp"
#include "tests/unit/emulator/test_renderer.hpp"
#include "transports/loopback/loopback.hpp"

#include <array>
#include <chrono>
#include <functional>
#include <thread>

namespace obscura::test {

inline SensorDescription small_sensor(std::int32_t width = 40, std::int32_t height = 30) {
    SensorDescription sensor;
    sensor.readout.width = width;
    sensor.readout.height = height;
    return sensor;
}

inline CameraSettings whole_sensor(const SensorDescription& sensor) {
    CameraSettings s;
    s.region = {0, 0, sensor.readout.width, sensor.readout.height};
    s.exposure_ns = 100 * ns_per_us;
    s.black_level_dn = sensor.detector.offset_dn;
    return s;
}

/// What renders: the thread that makes frames, or one of its own, which may do so ahead of triggers; with
/// poses from a stream.
enum class RendersOn { calling_thread, own_thread, own_thread_live };

/// Renderer, detector and maker for `sensor`.
struct MakerBench {
    explicit MakerBench(const SensorDescription& description = small_sensor(), std::int32_t band_rows = 8,
                        RendersOn renders = RendersOn::calling_thread, const Clock* other_clock = nullptr,
                        bool real_time = false, bool adapts = false)
        : sensor(description),
          renderer(scene, {}),
          detector(sensor, std::array{SpectralBand{}}, 0.025, 7),
          maker(renderer, detector, sensor, other_clock != nullptr ? *other_clock : clock,
                {.band_rows = band_rows,
                 .seed = 7,
                 .live_poses = renders == RendersOn::own_thread_live,
                 .adapts = adapts,
                 .real_time = real_time,
                 .enter_render =
                     renders == RendersOn::calling_thread ? nullptr : std::function<void()>([] {})}),
          pool(6, static_cast<std::size_t>(sensor.readout.width * sensor.readout.height),
               static_cast<std::size_t>(sensor.readout.height)) {}

    MonotonicClock clock;
    SensorDescription sensor;
    scene::Scene scene; ///< empty
    renderer::Renderer renderer;
    sensors::Detector detector;
    emulator::FrameMaker maker;
    FramePool pool;
};

/// A whole camera with one loopback transport. `camera_clock`: of camera and maker; null: the machine's,
/// which that of the released rows is in any case.
struct CameraBench : MakerBench {
    explicit CameraBench(const SensorDescription& description = small_sensor(), std::size_t keep = 5,
                         std::function<void(CameraSettings&)> adjust = {},
                         sync::OverTrigger policy = sync::OverTrigger::count,
                         emulator::LatePolicy late = emulator::LatePolicy::late, bool falling_edges = false,
                         emulator::SceneClockSettings scene_clock = {},
                         RendersOn renders = RendersOn::calling_thread, const Clock* camera_clock = nullptr)
        : MakerBench(description, 8, renders, camera_clock),
          loopback({4, keep,
                    [this](const FrameRef&) {
                        ++ended;
                        ended.notify_all();
                    }}),
          releaser({.max_rows = static_cast<std::size_t>(description.readout.height), .policy = late},
                   std::make_unique<MonotonicClock>(), &timing),
          camera(config(description, adjust, policy, falling_edges, std::move(scene_clock)), maker, releaser,
                 pool, camera_clock != nullptr ? *camera_clock : clock, log) {
        camera.add_transport(loopback);
        timing.set_transports({"loopback"});
        loopback.start();
    }
    ~CameraBench() {
        render_gate().open();
        camera.acquisition_stop(true);
        loopback.stop();
    }

    static emulator::CameraConfig config(const SensorDescription& sensor,
                                         const std::function<void(CameraSettings&)>& adjust,
                                         sync::OverTrigger policy, bool falling_edges = false,
                                         emulator::SceneClockSettings scene_clock = {}) {
        emulator::CameraConfig c;
        c.scene = std::move(scene_clock);
        c.ahead_tolerance_px = 0.02;
        c.over_trigger = policy;
        c.initial = whole_sensor(sensor);
        c.limits.overlapped = sensor.readout.overlapped;
        if (c.limits.overlapped) c.initial.trigger_overlap = TriggerOverlap::readout;
        if (policy == sync::OverTrigger::latch) c.initial.trigger_overlap = TriggerOverlap::previous_frame;
        if (adjust) adjust(c.initial);
        c.limits.sensor_width = sensor.readout.width;
        c.limits.sensor_height = sensor.readout.height;
        c.limits.black_level_max_dn = 2048;
        c.limits.lines = {LineEdges{true, falling_edges}, LineEdges{true, false}, LineEdges{true, true}};
        return c;
    }
    void wait_ended(std::uint32_t n) const {
        for (std::uint32_t seen = ended; seen < n; seen = ended)
            ended.wait(seen);
    }
    void wait_ready() const {
        while (!camera.trigger_ready())
            std::this_thread::sleep_for(std::chrono::microseconds(100));
    }

    std::atomic<std::uint32_t> ended{0};
    LogRing log;
    emulator::TimingLog timing;
    transports::LoopbackTransport loopback;
    emulator::Releaser releaser;
    emulator::Camera camera;
};

} // namespace obscura::test
