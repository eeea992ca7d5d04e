// SPDX-License-Identifier: Apache-2.0
// Frames rendered ahead for an edge that comes at another time: stars are those of a frame rendered at the
// edge, bodies within a fraction of a pixel, and the frame says so.
#include "emulator/frame_maker.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "sensors/sensor.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <thread>
#include <vector>

using namespace obscura;
using namespace obscura::emulator;

namespace {

constexpr std::int32_t size = 256;
constexpr double pixel_rad = 2e-4;
constexpr double distance_m = 1e5;

/// A camera that spins at 1 deg/s about an axis across its boresight, and a body of 60 px in radius that
/// spins at 1 deg/s too, among stars.
scene::Scene spinning_scene() {
    scene::Scene s;
    s.camera.width = s.camera.height = size;
    s.camera.pixel_pitch_m = 5.5e-6;
    s.camera.focal_length_m = s.camera.pixel_pitch_m / pixel_rad;
    s.camera.motion.samples[0].pose = {{-distance_m, 0, 0}, look_along({1, 0, 0}, {0, 0, 1})};
    s.camera.motion.spin_axis = {0.6, 0.8, 0};
    s.camera.motion.spin_rate_rad_s = std::numbers::pi / 180;
    s.sun.position_m = {-1e11, 1e11, 3e10};
    const double radius_m = 60 * pixel_rad * distance_m;
    s.bodies.push_back({"asteroid",
                        renderer::ProceduralBodyParameters{radius_m, {1, 0.9, 0.8}, 1, 5},
                        renderer::LommelSeeligerParameters{0.001},
                        {}});
    s.bodies[0].motion.samples = {{0, {}}};
    s.bodies[0].motion.spin_axis = {0, 0, 1};
    s.bodies[0].motion.spin_rate_rad_s = std::numbers::pi / 180;
    for (const auto& [x, y] : {std::pair{-100.0, -90.0}, {95.0, 100.0}, {-90.0, 95.0}, {100, -80}}) {
        const Vec3 d = normalized(
            rotate(s.camera.motion.samples[0].pose.orientation, {x * pixel_rad, y * pixel_rad, 1}));
        s.stars.push_back({std::atan2(d.y, d.x), std::asin(d.z), 1.5, 0.5});
    }
    return s;
}

SensorDescription sensor() {
    SensorDescription s;
    s.readout.width = s.readout.height = size;
    s.readout.shutter = Shutter::global;
    return s;
}

/// Makes frames on the calling thread, or ahead.
struct Unit {
    explicit Unit(bool ahead, std::uint32_t threads = 2)
        : renderer(spinning_scene(), renderer::RenderSettings{16, threads, 5}),
          maker(renderer, detector, description, clock,
                {.band_rows = 64,
                 .seed = 7,
                 .reprojects = ahead,
                 .enter_render = ahead ? std::function<void()>([] {}) : nullptr}) {}

    FrameOrder order(Time scene_time) const {
        FrameOrder o;
        o.frame_id = o.trigger_id = 2;
        o.scene_time = scene_time;
        o.settings.region = {0, 0, size, size};
        o.settings.exposure_ns = 8 * ns_per_ms;
        o.settings.gain_db = 12;
        o.settings.black_level_dn = description.detector.offset_dn;
        return o;
    }
    /// The frame of an edge at `at`, expected at `expected`.
    FrameRef make(Time expected, Time at, FrameWork& work) {
        maker.render_ahead(
            {.order = order(expected), .edge = Time{}, .tolerance_px = 0.02, .exact_time = false});
        while (maker.renders_ahead() && !maker.expected_is_ready())
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
        FrameRef frame = pool.acquire();
        REQUIRE(maker.prepare(order(at), *frame).empty());
        REQUIRE(maker.fill(*frame, nullptr, nullptr, &work));
        return frame;
    }

    MonotonicClock clock;
    SensorDescription description = sensor();
    renderer::Renderer renderer;
    sensors::Detector detector{description, std::array{SpectralBand{}}, 0.025, 7};
    FrameMaker maker;
    FramePool pool{3, static_cast<std::size_t>(size) * size, size};
};

/// Signal of a pixel over the level beside it.
struct Picture {
    explicit Picture(const Frame& f) : frame(f) {
        std::vector<std::uint16_t> all(f.pixels().begin(), f.pixels().end());
        std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 4), all.end());
        dark = all[all.size() / 4];
    }
    [[nodiscard]] double at(std::int32_t x, std::int32_t y) const {
        return frame.row(y)[static_cast<std::size_t>(x)] - dark;
    }
    const Frame& frame;
    double dark = 0;
};

/// Largest shift of the sunlit limb along rows: the difference of the light about it over the brightness
/// inside of it.
double edge_shift_px(const Picture& a, const Picture& b) {
    double most = 0;
    // Means of 32 rows, so that the noise of the samples and of the detector is small.
    for (std::int32_t k = 128 - 32; k < 128 + 32; k += 32) {
        double light = 0;
        double inside = 0;
        for (std::int32_t row = k; row < k + 32; ++row) {
            std::int32_t first = 20;
            while (first < 128 && b.at(first, row) < 500)
                ++first;
            for (std::int32_t x = first - 6; x < first + 6; ++x)
                light += a.at(x, row) - b.at(x, row);
            inside += b.at(first + 6, row);
        }
        most = std::max(most, std::abs(light) / inside);
    }
    return most;
}

} // namespace

TEST_CASE("a frame whose edge comes off its prediction is reprojected, its stars exact") {
    Unit plain(false);
    Unit ahead(true);
    std::mt19937 random(11);
    std::normal_distribution<double> jitter(0, 1e6);
    std::uint64_t moved = 0;
    for (int i = 0; i < 8; ++i) {
        const Time expected{40 * i * ns_per_ms};
        const Time at = expected + std::llround(jitter(random));
        FrameWork work;
        FrameWork unused;
        const FrameRef frame = ahead.make(expected, at, work);
        const FrameRef truth = plain.make(expected, at, unused);
        const Picture a(*frame);
        const Picture b(*truth);
        CAPTURE(i, at - expected, work.ahead_error_px);
        // Corners, where the stars are.
        std::size_t different = 0;
        double star_light = 0;
        for (const auto& [x0, y0] : {std::pair{0, 0}, {196, 196}, {0, 196}, {196, 0}})
            for (std::int32_t y = y0; y < y0 + 60; ++y)
                for (std::int32_t x = x0; x < x0 + 60; ++x) {
                    different += a.frame.row(y)[static_cast<std::size_t>(x)] !=
                                 b.frame.row(y)[static_cast<std::size_t>(x)];
                    star_light += b.at(x, y);
                }
        CHECK(star_light > 1000);
        CHECK(different == 0);
        CHECK(b.at(100, 128) > 500);
        CHECK(b.at(100, 128) < 3500);
        CHECK(edge_shift_px(a, b) < 0.05);
        const FrameQuality& quality = frame->info.quality;
        const bool reprojected = work.ahead_error_px > 0.02;
        moved += reprojected ? 1 : 0;
        CHECK(quality.rows_reprojected == (reprojected ? size : 0));
        CHECK(((frame->flags.load() & frame_biased) != 0) == reprojected);
        CHECK(((frame->flags.load() & frame_degraded) != 0) == reprojected);
        CHECK_THAT(work.ahead_error_px,
                   Catch::Matchers::WithinRel(std::abs(static_cast<double>(at - expected)) * 1e-9 *
                                                  std::numbers::pi / 180 / pixel_rad,
                                              0.2));
    }
    const AheadCounters counters = ahead.maker.ahead_counters();
    CHECK(moved >= 5);
    CHECK(counters.used == 8);
    CHECK(counters.moved == moved);
    CHECK(counters.discarded == 0);
}

TEST_CASE(
    "an exact prediction gives the bytes of a frame rendered at its edge; one far off is rendered anew") {
    Unit plain(false);
    Unit ahead(true);
    FrameWork work;
    for (const std::int64_t early_ns : {std::int64_t{0}, 50 * ns_per_ms}) {
        const Time at{40 * ns_per_ms + early_ns};
        const FrameRef frame = ahead.make(at + early_ns, at, work);
        const FrameRef truth = plain.make(at, at, work);
        CHECK(std::equal(frame->pixels().begin(), frame->pixels().end(), truth->pixels().begin()));
        CHECK(frame->info.quality.rows_degraded == 0);
    }
    CHECK(ahead.maker.ahead_counters().moved == 0);
    CHECK(ahead.maker.ahead_counters().discarded == 1);
}

TEST_CASE("reprojection takes nothing from the heap") {
    if (!obscura::test::allocations_are_counted()) return;
    Unit ahead(true, 1); // render threads of oneTBB are not real-time: one thread renders all
    FrameWork work;
    for (int i = 0; i < 6; ++i) {
        const Time expected{40 * i * ns_per_ms};
        const Time at = expected + (i < 3 ? 0 : ns_per_ms);
        if (i == 3) obscura::test::reset_allocation_counts();
        static_cast<void>(ahead.make(expected, at, work));
    }
    CHECK(ahead.maker.ahead_counters().moved == 3);
    CHECK(obscura::test::allocation_counts().realtime == 0);
}
