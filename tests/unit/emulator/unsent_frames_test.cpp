// SPDX-License-Identifier: Apache-2.0
// Frames that no transport takes but that of viewers.
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <memory>
#include <utility>

namespace unsent_frames_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

void trigger(CameraBench& bench, std::uint64_t id) {
    const Time now = bench.clock.now();
    bench.wait_ready();
    bench.camera.on_trigger({id, now, now});
}

} // namespace

TEST_CASE("a frame that viewers alone have taken is counted as unsent", "[emulator]") {
    std::atomic<std::uint32_t> seen{0};
    transports::LoopbackTransport viewers({4, 0, [&seen](const FrameRef&) {
                                               ++seen;
                                               seen.notify_all();
                                           }});
    CameraBench bench;
    bench.camera.add_viewers(viewers);
    viewers.start();
    REQUIRE(bench.camera.acquisition_start());
    trigger(bench, 1);
    bench.wait_ended(1);
    CHECK(bench.camera.counters().unsent == 0);
    bench.loopback.stop(); // takes no frames any more
    trigger(bench, 2);
    for (std::uint32_t n = seen; n < 2; n = seen)
        seen.wait(n);
    bench.camera.acquisition_stop(true);
    viewers.stop();
    const CameraCounters c = bench.camera.counters();
    CHECK(c.frames == 2);
    CHECK(c.unsent == 1);
    CHECK(c.dropped == 0);
}

TEST_CASE("where frames are for viewers only, none is unsent", "[emulator]") {
    MakerBench bench;
    std::atomic<std::uint32_t> seen{0};
    transports::LoopbackTransport viewers({4, 0, [&seen](const FrameRef&) {
                                               ++seen;
                                               seen.notify_all();
                                           }});
    TimingLog timing;
    Releaser releaser({.max_rows = 30}, std::make_unique<MonotonicClock>(), &timing);
    LogRing log;
    Camera camera(CameraBench::config(bench.sensor, {}, sync::OverTrigger::count), bench.maker, releaser,
                  bench.pool, bench.clock, log);
    camera.add_viewers(viewers);
    viewers.start();
    REQUIRE(camera.acquisition_start());
    const Time now = bench.clock.now();
    camera.on_trigger({1, now, now});
    seen.wait(0);
    camera.acquisition_stop(true);
    viewers.stop();
    CHECK(camera.counters().frames == 1);
    CHECK(camera.counters().unsent == 0);
}

} // namespace unsent_frames_test
