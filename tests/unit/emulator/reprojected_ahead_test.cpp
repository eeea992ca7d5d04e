// SPDX-License-Identifier: Apache-2.0
// Frames rendered ahead for an edge that comes at another time, whole, of several windows and of lines: stars
// are those of a frame rendered at the edge, bodies within a fraction of a pixel, and the frame says so.
#include "emulator/camera/frame_maker.hpp"
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

namespace reprojected_ahead_test {

using namespace obscura;
using namespace obscura::emulator;

namespace {

constexpr std::int32_t size = 256;
constexpr double pixel_rad = 2e-4;
constexpr double distance_m = 1e5;
constexpr double lines_per_s = 200;

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

/// The same from a camera that turns about a row of its sensor: 0.8 px a line.
scene::Scene swept_scene() {
    scene::Scene s = spinning_scene();
    s.camera.motion.spin_axis = {1, 0, 0};
    s.camera.motion.spin_rate_rad_s = 0.8 * lines_per_s * pixel_rad;
    return s;
}

SensorDescription sensor(Shutter shutter = Shutter::global) {
    SensorDescription s;
    s.readout.width = s.readout.height = size;
    s.readout.shutter = shutter;
    s.readout.line_rate_hz = lines_per_s;
    return s;
}

/// Makes frames on the calling thread, or ahead.
struct Unit {
    explicit Unit(bool ahead, std::uint32_t threads = 2, Shutter shutter = Shutter::global)
        : description(sensor(shutter)),
          renderer(shutter == Shutter::push_broom ? swept_scene() : spinning_scene(),
                   renderer::RenderSettings{16, threads, 5}),
          maker(renderer, detector, description, clock,
                {.band_rows = 64,
                 .seed = 7,
                 .reprojects = ahead,
                 .enter_render = ahead ? std::function<void()>([] {}) : nullptr}) {}

    FrameOrder order(Time scene_time) const {
        FrameOrder o;
        o.frame_id = o.trigger_id = 2;
        o.scene_time = scene_time;
        o.settings.region = {0, description.readout.shutter == Shutter::push_broom ? size / 2 : 0, size,
                             size};
        o.settings.exposure_ns = exposure_ns;
        o.settings.gain_db = 12;
        o.settings.black_level_dn = description.detector.offset_dn;
        if (!windows.empty()) o.settings.set_windows(windows);
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

    std::int64_t exposure_ns = 8 * ns_per_ms;
    std::vector<CameraWindow> windows; ///< none: the whole sensor
    MonotonicClock clock;
    SensorDescription description;
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

/// Largest shift of the limb from one picture to the other: the difference of the light about it over the
/// brightness inside of it, on `count` lines from `first` on, of which some are a mean. `at(picture, i,
/// line)`: light at point `i` of a line, from outside.
template<typename At>
double edge_shift_px(const Picture& a, const Picture& b, std::int32_t first, std::int32_t count, const At& at,
                     std::int32_t mean_of = 32) {
    double most = 0;
    // Means of lines, so that the noise of the samples and of the detector is small.
    for (std::int32_t k = first; k < first + count; k += mean_of) {
        double light = 0;
        double inside = 0;
        for (std::int32_t line = k; line < k + mean_of; ++line) {
            std::int32_t edge = 20;
            while (edge < 128 && at(b, edge, line) < 300)
                ++edge;
            for (std::int32_t i = edge - 6; i < edge + 6; ++i)
                light += at(a, i, line) - at(b, i, line);
            inside += at(b, edge + 6, line);
        }
        most = std::max(most, std::abs(light) / inside);
    }
    return most;
}

/// Shift of the sunlit limb, along rows.
double edge_shift_px(const Picture& a, const Picture& b) {
    return edge_shift_px(a, b, 128 - 32, 64,
                         [](const Picture& p, std::int32_t i, std::int32_t line) { return p.at(i, line); });
}

double light_in(const Picture& p, const Region& part) {
    double light = 0;
    for (std::int32_t y = part.y; y < part.y + part.height; ++y)
        for (std::int32_t x = part.x; x < part.x + part.width; ++x)
            light += p.at(x, y);
    return light;
}

bool same_pixels(const Frame& a, const Frame& b, const Region& part) {
    for (std::int32_t y = part.y; y < part.y + part.height; ++y) {
        const auto of = [&](const Frame& f) {
            return f.row(y).subspan(static_cast<std::size_t>(part.x), static_cast<std::size_t>(part.width));
        };
        if (!std::equal(of(a).begin(), of(a).end(), of(b).begin())) return false;
    }
    return true;
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
        // The stated error is a bound.
        const bool reprojected = quality.rows_reprojected > 0;
        CHECK(reprojected == (work.ahead_error_px > (reprojected ? 0.02 : 0.025)));
        moved += reprojected ? 1 : 0;
        // The body has a radius of 60 px; groups of rows without it are what they should be.
        CHECK(quality.rows_reprojected >= (reprojected ? 112 : 0));
        CHECK(quality.rows_reprojected <= (reprojected ? 192 : 0));
        CHECK(quality.rows_degraded == quality.rows_reprojected);
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

TEST_CASE("frames of several windows are reprojected window by window") {
    for (const std::int64_t late_ns : {2 * ns_per_ms, -3 * ns_per_ms, std::int64_t{0}}) {
        Unit plain(false, 2, Shutter::rolling);
        Unit ahead(true, 2, Shutter::rolling);
        // The limb in five groups of rows, and two stars.
        for (Unit* const unit : {&plain, &ahead})
            unit->windows = {{{20, 88, 140, 80}, unit->exposure_ns},
                             {{0, 0, 60, 64}, unit->exposure_ns},
                             {{196, 192, 60, 64}, unit->exposure_ns}};
        FrameWork work;
        FrameWork unused;
        const Time expected{80 * ns_per_ms};
        const FrameRef frame = ahead.make(expected, expected + late_ns, work);
        const FrameRef truth = plain.make(expected, expected + late_ns, unused);
        REQUIRE(frame->info.window_count == 3);
        const Picture a(*frame);
        const Picture b(*truth);
        const double shift_px = edge_shift_px(
            a, b, 0, 64, [](const Picture& p, std::int32_t i, std::int32_t line) { return p.at(i, line); });
        CAPTURE(late_ns, shift_px);
        CHECK((work.ahead_error_px > 0.02) == (late_ns != 0));
        CHECK(same_pixels(*frame, *truth, {0, 80, 60, 128}));
        CHECK(light_in(b, {0, 80, 60, 64}) > 200);
        CHECK(light_in(b, {0, 144, 60, 64}) > 200);
        CHECK(shift_px < 0.05);
        CHECK(same_pixels(*frame, *truth, {0, 0, 140, 80}) == (late_ns == 0));
        CHECK(frame->info.quality.rows_reprojected == (late_ns != 0 ? 80 : 0));
        CHECK(ahead.maker.ahead_counters().moved == (late_ns != 0 ? 1 : 0));
        CHECK(ahead.maker.ahead_counters().discarded == 0);
    }
}

TEST_CASE("lines of a push-broom sensor are made of those of about the same time") {
    // The middle line looks at the body, or one near the end does.
    for (const std::int64_t middle_ms : {640, 1140})
        for (const std::int64_t late_ns : {12'300 * ns_per_us, -7'100 * ns_per_us, std::int64_t{0}}) {
            Unit plain(false, 2, Shutter::push_broom);
            Unit ahead(true, 2, Shutter::push_broom);
            plain.exposure_ns = ahead.exposure_ns = 4'900'000;
            const Time expected{-middle_ms * ns_per_ms};
            FrameWork work;
            FrameWork unused;
            const FrameRef frame = ahead.make(expected, expected + late_ns, work);
            const FrameRef truth = plain.make(expected, expected + late_ns, unused);
            const Picture a(*frame);
            const Picture b(*truth);
            const FrameQuality& quality = frame->info.quality;
            CAPTURE(middle_ms, late_ns, work.ahead_error_px, quality.rows_reprojected, b.dark);
            CHECK_THAT(work.ahead_error_px,
                       Catch::Matchers::WithinRel(std::abs(static_cast<double>(late_ns)) * 1e-9 * 160, 0.2));
            // Beside the body, where the stars are.
            CHECK(same_pixels(*frame, *truth, {0, 0, 50, size}));
            CHECK(same_pixels(*frame, *truth, {210, 0, 46, size}));
            CHECK(ahead.maker.ahead_counters().discarded == 0);
            CHECK(ahead.maker.ahead_counters().moved == (late_ns != 0 ? 1 : 0));
            if (late_ns == 0) {
                CHECK(same_pixels(*frame, *truth, {0, 0, size, size}));
                CHECK(quality.rows_reprojected == 0);
                continue;
            }
            CHECK(quality.rows_reprojected >= 64);
            CHECK(quality.rows_reprojected <= 224);
            CHECK(quality.rows_degraded == quality.rows_reprojected);
            if (middle_ms == 640) {
                CHECK(light_in(b, {0, 0, 50, size}) > 200);
                const double across_px = edge_shift_px(a, b);
                // From the side that the Sun is on.
                const double along_px =
                    edge_shift_px(a, b, 96, 64, [](const Picture& p, std::int32_t i, std::int32_t line) {
                        return p.at(line, size - 1 - i);
                    });
                CAPTURE(across_px, along_px);
                CHECK(across_px < 0.05);
                CHECK(along_px < 0.05);
            }
            // What comes after the last line that was expected is rendered.
            if (middle_ms == 1140 && late_ns > 0) CHECK(same_pixels(*frame, *truth, {0, 240, size, 16}));
        }
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

} // namespace reprojected_ahead_test
