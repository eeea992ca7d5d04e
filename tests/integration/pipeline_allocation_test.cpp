// SPDX-License-Identifier: Apache-2.0
// After start-up, threads with deadlines take nothing from the heap: trigger, pipeline, detector, release.
#include "config/document.hpp"
#include "core/camera/scene_truth.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/camera/releaser.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/daemon/daemon.hpp"
#include "emulator/unit/assemble.hpp"
#include "sync/timer.hpp"
#include "tests/integration/daemon_bench.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/catch.hpp"
#include "transports/fault_rules.hpp"
#include "transports/gige/channels/payload.hpp"
#include "transports/loopback/loopback.hpp"
#include "transports/watch/frame_ring_reader.hpp"
#include "transports/watch/watch.hpp"

#include <sys/mman.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iostream>
#include <map>
#include <memory>
#include <sstream>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace pipeline_allocation_test {

using namespace obscura;
using namespace obscura::test;

namespace {

// Where the compiler cannot see that the memory is unused.
void* volatile sink;

void allocate_twice() {
    sink = std::malloc(10);
    std::free(sink);
    sink = ::operator new(100);
    ::operator delete(sink);
}

/// Whether allocations are counted; says so if not.
bool heap_is_counted() {
    if (allocations_are_counted()) return true;
    std::cout << "SKIPPED: sanitizers bring a heap of their own\n";
    return false;
}

/// Page faults so far of the threads of this process, by thread and name.
std::map<std::string, std::uint64_t> page_faults() {
    std::map<std::string, std::uint64_t> faults;
    for (const auto& task : std::filesystem::directory_iterator("/proc/self/task")) {
        std::ifstream in(task.path() / "stat");
        std::string line;
        std::getline(in, line);
        const std::size_t end = line.rfind(')');
        if (end == std::string::npos) continue;
        // state, ppid, pgrp, session, tty_nr, tpgid, flags, minflt, cminflt, majflt: proc(5).
        std::istringstream fields(line.substr(end + 2));
        std::string skipped;
        std::uint64_t minor = 0, minor_of_children = 0, major = 0;
        for (int i = 0; i < 7; ++i)
            fields >> skipped;
        fields >> minor >> minor_of_children >> major;
        const std::size_t begin = line.find('(') + 1;
        faults[line.substr(begin, end - begin) + " " + task.path().filename().string()] = minor + major;
    }
    return faults;
}

/// A camera that crosses the ground of a Moon without data at 60 km, 1.6 km/s.
std::string low_flight(const TempFolder& folder, const std::string& sun_visibility) {
    constexpr double radius_m = 1737400, altitude_m = 60e3, rad_per_s = 1600 / radius_m;
    std::string path = "time_s,x_m,y_m,z_m\n";
    for (int t = -10; t <= 400; ++t)
        path += std::to_string(t) + "," + std::to_string((radius_m + altitude_m) * std::cos(t * rad_per_s)) +
                "," + std::to_string((radius_m + altitude_m) * std::sin(t * rad_per_s)) + ",0\n";
    folder.write("flight.csv", path);
    return folder
        .write("low.toml", R"(name = "low"
[sun]
direction = [0.4, 1, 0.2]
distance_au = 1
[camera]
focal_length_mm = 10
aperture_mm = 5
psf_sigma_px = 0.6
trajectory = "flight.csv"
look_at = "moon"
up = [0, 0, 1]
[[body]]
name = "moon"
shape = "planet"
radii_m = [1737400, 1737400, 1737400]
albedo = 0.2
sun_visibility = ")" + sun_visibility +
                               R"("
[body.detail]
terrain = "highlands"
crater_age_ga = 3.9
crater_least_m = 50
)")
        .string();
}

/// A camera that goes over ground strewn with boulders at 15 m, 0.3 m/s.
std::string boulder_walk(const TempFolder& folder, const std::string& sun_visibility) {
    folder.write("walk.csv", "time_s,x_m,y_m,z_m\n-100,-30,1,15\n100,30,1,15\n");
    return folder
        .write("walk.toml", R"(name = "walk"
[sun]
direction = [1, 0.3, 0.4]
distance_au = 1
[camera]
focal_length_mm = 2
aperture_mm = 1
psf_sigma_px = 0.6
trajectory = "walk.csv"
boresight = [0, 0, -1]
up = [0, 1, 0]
[[body]]
name = "ground"
shape = "terrain"
half_edge_m = 64
albedo = 0.2
sun_visibility = ")" + sun_visibility +
                                R"("
[body.detail]
terrain = "highlands"
boulders_per_m2 = 0.3
boulder_least_m = 0.8
boulder_largest_m = 3
)")
        .string();
}

/// A camera whose frames go to `look`, triggered by a timer until it is destroyed or stopped.
class TriggeredCamera {
public:
    TriggeredCamera(emulator::Imaging& imaging, std::int32_t rows, int rate_hz,
                    std::function<void(const FrameRef&)> look)
        : loopback_({8, 0,
                     [this, look = std::move(look)](const FrameRef& frame) {
                         look(frame);
                         ++ended_;
                         ended_.notify_all();
                     }}),
          releaser_(settings(rows), std::make_unique<MonotonicClock>()),
          camera_(imaging.camera, *imaging.maker, releaser_, *imaging.pool, imaging.clock, log_),
          trigger_(timer(rate_hz), std::make_unique<MonotonicClock>()) {
        camera_.add_transport(loopback_);
        loopback_.start();
        REQUIRE(camera_.acquisition_start());
        trigger_.start(camera_);
    }

    /// Waits until so many frames have ended.
    void wait_for(std::uint32_t frames) {
        for (std::uint32_t seen = ended_; seen < frames; seen = ended_)
            ended_.wait(seen);
    }
    void stop() {
        trigger_.stop();
        camera_.acquisition_stop(true);
        loopback_.stop();
    }
    [[nodiscard]] const emulator::Camera& camera() const { return camera_; }

private:
    static emulator::ReleaserSettings settings(std::int32_t rows) {
        emulator::ReleaserSettings settings;
        settings.max_rows = rows;
        return settings;
    }
    static sync::TimerSettings timer(int rate_hz) {
        sync::TimerSettings settings;
        settings.rate = {rate_hz, 1};
        return settings;
    }

    std::atomic<std::uint32_t> ended_{0};
    transports::LoopbackTransport loopback_;
    emulator::Releaser releaser_;
    LogRing log_;
    emulator::Camera camera_;
    sync::TimerTrigger trigger_;
};

/// Threads that look at a camera until they are destroyed: a viewer, and a reader of the frame ring that
/// copies whatever stands there.
class Onlookers {
public:
    explicit Onlookers(transports::WatchTransport& watch)
        : watch_(watch), viewer_([this] { view(); }), reader_([this] { read(); }) {}
    ~Onlookers() {
        stop_ = true;
        viewer_.join();
        reader_.join();
    }
    Onlookers(const Onlookers&) = delete;
    Onlookers& operator=(const Onlookers&) = delete;

    /// Frames that each of them has seen at least.
    [[nodiscard]] std::uint64_t seen() const { return std::min(viewed_.load(), read_.load()); }

private:
    static constexpr std::chrono::milliseconds turn{100};

    void view() {
        for (std::uint64_t last = 0; !stop_;)
            if (const auto frame = watch_.newest(last, std::chrono::steady_clock::now() + turn, stop_)) {
                last = frame->number;
                ++viewed_;
            }
    }
    void read() {
        const transports::FrameRingReader ring{FileDescriptor(::dup(watch_.ring().descriptor()))};
        std::vector<std::uint16_t> copy;
        for (std::uint64_t last = 0; !stop_; std::this_thread::yield()) {
            const auto frame = ring.read();
            if (!frame || frame->serial == last) continue;
            copy.resize(frame->pixels.size());
            if (ring.copy(*frame, copy)) last = frame->serial, ++read_;
        }
    }

    transports::WatchTransport& watch_;
    std::atomic<bool> stop_{false};
    std::atomic<std::uint64_t> viewed_{0}, read_{0};
    std::thread viewer_, reader_;
};

/// Arms one rule of that kind, as the call faults.set does.
void arm(emulator::CameraUnit& unit, const char* kind) {
    transports::FaultRules* const faults = unit.fault_rules();
    REQUIRE(faults != nullptr);
    const transports::FaultRules::Row row = faults->blank();
    const config::Value table = config::parse_text("kind = \"" + std::string(kind) + "\"", "rule");
    config::Mistakes mistakes;
    config::read_section(&table, {}, {"rule", {}}, row.section, mistakes);
    mistakes.throw_if_any();
    unit.run_between_commands([&](const std::string&) { faults->arm({row}); });
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
    if (!heap_is_counted()) return;
    const TempFolder folder;
    DaemonOptions options;
    options.size = 256;
    // With a model in each place that the sensor has for one.
    folder.write(
        "pixel.sns",
        "scalar light(scalar mean, scalar x, scalar y) { return mean * (1 + 1e-4 * x); }\n"
        "scalar collect(scalar charge, scalar x, scalar y)\n"
        "{ return 4e4 * (1 - exp(-charge / 4e4)) * (1 + 0.01 * normal(0)) + (y == 1 ? M_NAN : 0); }\n"
        "scalar convert(scalar signal, scalar x, scalar y) { return signal + normal(2); }\n");
    options.more = "[sensor]\nmodel = { model = \"pixel.sns\" }\n";
    const emulator::DaemonConfig config = emulator::load_config(write_configuration(folder, options));
    // With truth tables, which are listed on the rendering thread.
    emulator::Imaging imaging(config, 12, {}, {.scene_entries = 1000});
    std::atomic<std::uint64_t> listed{0};
    TriggeredCamera run(imaging, 256, 50, [&](const FrameRef& frame) {
        if (const SceneTruth* truth = frame->final_scene_truth()) listed += truth->entries.size();
    });
    run.wait_for(10); // the worker pools of the renderer settle in the first frames
    reset_allocation_counts();
    run.wait_for(110);
    const AllocationCounts counts = allocation_counts();
    run.stop();
    CHECK(counts.realtime == 0);
    CHECK(listed > 110);
    CHECK(imaging.detector->values_replaced() >= 100 * 256);
    std::cout << "allocations during 100 frames: " << counts.realtime << " on real-time threads, "
              << counts.all << " in all\n";
}

TEST_CASE("frames of a terrain neither allocate nor fault on real-time threads while tiles are made") {
    if (!heap_is_counted()) return;
    const TempFolder folder;
    DaemonOptions options;
    options.size = 96;
    const std::string sun_visibility = GENERATE("traced", "tiles");
    CAPTURE(sun_visibility);
    options.scene = low_flight(folder, sun_visibility);
    const emulator::DaemonConfig config = emulator::load_config(write_configuration(folder, options));
    emulator::Imaging imaging(config, 12, {}, {.scene_entries = 1000}, emulator::RenderAhead::off, true);
    std::atomic<std::uint64_t> craters{0}, coarse{0}, missing{0};
    TriggeredCamera run(imaging, 96, 50, [&](const FrameRef& frame) {
        if (const SceneTruth* truth = frame->final_scene_truth())
            for (const TruthEntry& e : truth->entries)
                craters += e.kind == TruthKind::crater ? 1 : 0;
        missing += frame->info.quality.tiles_missing;
        if (frame->info.quality.lod_deficit_share > 0) ++coarse;
    });
    run.wait_for(20); // pools settle in the first frames
    // As the daemon does.
    const RealtimeGrant locked = lock_memory();
    if (!locked.granted) std::cout << locked.why << '\n';
    const std::uint64_t tiles_before = imaging.renderer->work().tiles_missed;
    reset_allocation_counts();
    const auto faults_before = page_faults();
    // OBSCURA_TERRAIN_FRAMES: more, by hand.
    const char* const frames = std::getenv("OBSCURA_TERRAIN_FRAMES");
    run.wait_for(20 + (frames != nullptr ? static_cast<std::uint32_t>(std::atoi(frames)) : 300));
    const AllocationCounts counts = allocation_counts();
    const auto faults = page_faults();
    run.stop();
    CHECK(counts.realtime == 0);
    // The terrain began coarse, and the frames say so.
    CHECK(coarse > 0);
    CHECK(missing > 0);
    CHECK(run.camera().counters().lod.frames == coarse);
    CHECK(run.camera().counters().lod.tiles_missing == missing);
    CHECK(tiles_before > 0);
    CHECK(craters > 50);
    int checked = 0;
    for (const auto& [thread, count] : faults) {
        const auto before = faults_before.find(thread);
        const std::uint64_t own = count - (before != faults_before.end() ? before->second : 0);
        std::cout << thread << ": " << own << " page faults\n";
        const std::string name = thread.substr(0, thread.rfind(' '));
        INFO(thread);
        if (name == "render" || name == "detector" || name == "release" || name == "trigger-timer") {
            ++checked;
            CHECK(own == 0);
        }
        // Entries of the truth table that no frame had so far, where memory could not be locked.
        if (name == "pipeline") CHECK(own < 20);
    }
    CHECK(checked >= 4);
    munlockall();
}

TEST_CASE("frames of boulders near the camera allocate nothing on real-time threads") {
    if (!heap_is_counted()) return;
    const TempFolder folder;
    DaemonOptions options;
    options.size = 96;
    const std::string sun_visibility = GENERATE("traced", "tiles");
    CAPTURE(sun_visibility);
    options.scene = boulder_walk(folder, sun_visibility);
    const emulator::DaemonConfig config = emulator::load_config(write_configuration(folder, options));
    emulator::Imaging imaging(config, 12, {}, {.scene_entries = 1000}, emulator::RenderAhead::off, true);
    std::atomic<std::uint64_t> boulders{0};
    TriggeredCamera run(imaging, 96, 50, [&](const FrameRef& frame) {
        if (const SceneTruth* truth = frame->final_scene_truth())
            for (const TruthEntry& e : truth->entries)
                boulders += e.kind == TruthKind::boulder && e.visible_share > 0 ? 1 : 0;
    });
    run.wait_for(20);
    reset_allocation_counts();
    run.wait_for(170);
    const AllocationCounts counts = allocation_counts();
    run.stop();
    CHECK(counts.realtime == 0);
    CHECK(boulders > 300);
}

TEST_CASE("viewers, other scenes and faults make no real-time thread allocate") {
    if (!heap_is_counted()) return;
    const TempFolder folder;
    DaemonOptions options;
    options.address = own_address(53);
    options.size = 96;
    options.rate_hz = 50;
    options.daemon_more = "autostart = true\n";
    const std::filesystem::path file = write_configuration(folder, options);
    emulator::Daemon daemon(emulator::load_config(file));
    daemon.start();
    const auto frames = [&] { return daemon.camera().counters().complete; };
    const auto wait_for = [&](std::uint64_t more) {
        for (const std::uint64_t end = frames() + more; frames() < end; daemon.tick())
            std::this_thread::sleep_for(std::chrono::milliseconds(5));
    };
    constexpr std::uint64_t settle = 20; // frames until the renderer's workers have the memory that they need
    wait_for(settle);
    reset_allocation_counts();
    std::uint64_t realtime = 0;
    {
        const Onlookers onlookers(*daemon.unit(0).watch());
        for (const char* kind : {"lose", "skip_frame", "freeze_frame"}) {
            arm(daemon.unit(0), kind);
            wait_for(20);
            std::string scene = text_of(folder.path() / "scene.toml");
            scene.replace(scene.find("[500, 400, 300]"), 15, "[600, 400, 300]");
            options.scene = folder.write(std::string(kind) + ".toml", scene).string();
            const emulator::DaemonConfig next = emulator::load_config(write_configuration(folder, options));
            CHECK(daemon.unit(0).prepare(next, {}) == "");
            realtime += allocation_counts().realtime;
            daemon.unit(0).apply_reload(next);
            wait_for(settle);
            reset_allocation_counts();
        }
        wait_for(20);
        CHECK(onlookers.seen() > 20);
    }
    const AllocationCounts counts = allocation_counts();
    daemon.stop();
    CHECK(realtime + counts.realtime == 0);
    CHECK(counts.all > 0);
}

} // namespace pipeline_allocation_test
