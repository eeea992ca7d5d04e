// SPDX-License-Identifier: Apache-2.0
// After start-up, threads with deadlines take nothing from the heap: trigger, pipeline, detector, release.
#include "core/realtime.hpp"
#include "core/scene_truth.hpp"
#include "emulator/assemble.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/releaser.hpp"
#include "sync/timer.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/catch.hpp"
#include "transports/gige/channels/payload.hpp"
#include "transports/loopback/loopback.hpp"

#include <atomic>
#include <cstdlib>
#include <iostream>

using namespace obscura;
using namespace obscura::test;

namespace {

// Where the compiler cannot see that nobody uses the memory.
void* volatile sink;

void allocate_twice() {
    sink = std::malloc(10);
    std::free(sink);
    sink = ::operator new(100);
    ::operator delete(sink);
}

} // namespace

TEST_CASE("the guard sees allocations of real-time threads and no others") {
    if (!allocations_are_counted()) return;
    reset_allocation_counts();
    allocate_twice();
    CHECK(allocation_counts().all >= 2);
    CHECK(allocation_counts().realtime == 0);
    std::thread thread([] {
        declare_this_thread_realtime();
        reset_allocation_counts();
        allocate_twice();
    });
    thread.join();
    CHECK(allocation_counts().realtime == 2);
}

TEST_CASE("binning a frame on its way out allocates nothing") {
    if (!allocations_are_counted()) return;
    FramePool pool(1, 64 * 48, 48);
    const FrameRef frame = pool.acquire();
    frame->info.width = 64;
    frame->info.height = 48;
    frame->info.bits_per_pixel = 12;
    frame->info.pixel_format = PixelFormat::mono12p;
    transports::gige::PayloadFormat format;
    format.max_width = 64;
    format.max_height = 48;
    format.max_image_bytes = 64 * 48 * 2;
    format.chunks = 0x3FFFF;
    format.truth_entries = 10;
    format.binning = {2, 4};
    transports::gige::Payload payload;
    payload.reserve(format);
    bool fits = false;
    std::thread thread([&] {
        declare_this_thread_realtime();
        reset_allocation_counts();
        fits = payload.begin(*frame, 1, 500);
        for (std::int32_t rows = 0; fits && rows <= 48; rows += 6) {
            frame->publish_rows(rows);
            payload.update(*frame);
        }
    });
    thread.join();
    CHECK(allocation_counts().realtime == 0);
    REQUIRE(fits);
    CHECK(payload.image() == Region{0, 0, 32, 12});
    CHECK(payload.ready_packets() == payload.packets());
}

TEST_CASE("a hundred triggered frames allocate nothing on real-time threads") {
    if (!allocations_are_counted()) {
        std::cout << "SKIPPED: sanitizers bring a heap of their own\n";
        return;
    }
    const TempFolder folder;
    DaemonOptions options;
    options.size = 256;
    const emulator::DaemonConfig config = emulator::load_config(write_configuration(folder, options));
    // With truth tables, which are listed on the rendering thread.
    emulator::Imaging imaging(config, 12, {}, {.scene_entries = 1000});
    std::atomic<std::uint32_t> ended{0};
    std::atomic<std::uint64_t> listed{0};
    transports::LoopbackTransport loopback({8, 0, [&](const FrameRef& frame) {
                                                if (const SceneTruth* truth = frame->final_scene_truth())
                                                    listed += truth->entries.size();
                                                ++ended;
                                                ended.notify_all();
                                            }});
    emulator::ReleaserSettings release;
    release.max_rows = 256;
    emulator::Releaser releaser(release, std::make_unique<MonotonicClock>());
    LogRing log;
    emulator::Camera camera(imaging.camera, *imaging.maker, releaser, *imaging.pool, imaging.clock, log);
    camera.add_transport(loopback);
    loopback.start();
    sync::TimerSettings timer;
    timer.rate = {50, 1};
    sync::TimerTrigger trigger(timer, std::make_unique<MonotonicClock>());

    REQUIRE(camera.acquisition_start());
    trigger.start(camera);
    const auto wait_for = [&](std::uint32_t n) {
        for (std::uint32_t seen = ended; seen < n; seen = ended)
            ended.wait(seen);
    };
    wait_for(10); // the worker pools of the renderer settle in the first frames
    reset_allocation_counts();
    wait_for(110);
    const AllocationCounts counts = allocation_counts();
    trigger.stop();
    camera.acquisition_stop(true);
    loopback.stop();
    CHECK(counts.realtime == 0);
    CHECK(listed > 110);
    std::cout << "allocations during 100 frames: " << counts.realtime << " on real-time threads, "
              << counts.all << " in all\n";
}
