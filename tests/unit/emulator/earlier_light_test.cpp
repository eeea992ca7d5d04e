// SPDX-License-Identifier: Apache-2.0
// Rows made of earlier frames, of the real renderer: they take no memory, and their levels give them again.
#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "tests/support/allocation_guard.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/adaptive_rig.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <thread>
#include <vector>

namespace earlier_light_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;

namespace {

/// An asteroid that crosses a third of a pixel from frame to frame, a rock below a pixel and stars.
scene::Scene moving_scene() {
    scene::Scene s = level_asteroid();
    scene::Body rock = s.bodies[0];
    s.bodies[0].motion.samples = {{-10, {{0, 0, -500}, {}}}, {10, {{0, 0, 500}, {}}}};
    const Quat camera = s.camera.motion.samples[0].pose.orientation;
    const double pixel_rad = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const Vec3 side = rotate(camera, {1, 0.1, 0});
    rock.name = "rock";
    rock.shape = renderer::EllipsoidParameters{{1, 1, 1}};
    rock.motion.samples[0].pose.position_m = side * (-115 * pixel_rad * 1e5 / length(side));
    s.bodies.push_back(rock);
    for (const double up : {-0.4, 0.2, 0.35}) {
        const Vec3 star = normalized(rotate(camera, {105 * pixel_rad, size * up * pixel_rad, 1}));
        s.stars.push_back({std::atan2(star.y, star.x), std::asin(star.z), 3, 0.5});
    }
    return s;
}

Time mid_of(std::uint64_t id) {
    return Time{static_cast<std::int64_t>(id) * 100 * ns_per_ms};
}

} // namespace

TEST_CASE("rows of an earlier frame take no memory, from the first one on") {
    if (!allocations_are_counted()) return;
    const renderer::Renderer renderer(moving_scene(), settings_of(1));
    renderer::Workspace alone(renderer, size, size);
    FakeClock clock;
    AdaptiveFrame frame(
        renderer.band_count() * pixels, pixels, size, clock, [] {}, &alone);
    KeptFrames kept([&] { return std::make_unique<renderer::ReprojectionSource>(renderer, size, size); });
    FrameLight light;
    light.renderer = &renderer;
    light.windows = {{{0, 0, size, size}, 0}};
    for (std::int32_t row = 0; row < size; row += block_rows)
        light.blocks.push_back({.first_row = row, .rows = block_rows});
    light.adapts = true;
    light.period_ns = 100 * ns_per_ms;
    light.from_plan_ns = 0;
    const bool rolling = GENERATE(false, true);
    const auto begin = [&](std::uint64_t id, std::int64_t due_in_ns) {
        light.frame_id = id;
        light.rows.clear();
        for (std::int32_t row = 0; row < size; ++row) {
            const Time mid = mid_of(id) + (rolling ? row * 10'000 : 0);
            light.rows.push_back({mid - ns_per_ms, mid + ns_per_ms});
        }
        light.common_mid = renderer::common_mid(light.rows);
        light.due.assign(light.blocks.size(), clock.now() + due_in_ns);
        REQUIRE(frame.begin(light, kept.earlier(light)));
        light.keep = kept.begin(light);
        frame.claim(0);
    };
    std::vector<float> image(pixels);
    const auto part_of = [&](std::size_t index) {
        return std::span(image).subspan(index * block_rows * size,
                                        static_cast<std::size_t>(block_rows) * size);
    };
    QualityController controller;
    const std::atomic<bool> cancel{false};
    begin(1, ns_per_s);
    REQUIRE(frame.render(controller, cancel));
    for (std::size_t b = 0; b < light.blocks.size(); ++b)
        frame.take(b, part_of(b));
    REQUIRE(frame.is_whole());
    kept.accept(light, 0.01);
    for (const QualityLevel level : {QualityLevel::reprojected, QualityLevel::repeated}) {
        begin(level == QualityLevel::reprojected ? 2 : 3,
              level == QualityLevel::reprojected ? ns_per_s : -ns_per_s);
        std::fill(image.begin(), image.end(), -1.0F);
        std::uint64_t allocations = 1;
        // A new thread has no memory of its own yet.
        std::thread([&] {
            declare_this_thread_realtime();
            reset_allocation_counts();
            for (std::size_t b = 0; b < light.blocks.size(); ++b) {
                frame.take_earlier(b);
                frame.take(b, part_of(b));
            }
            frame.try_last_resort();
            allocations = allocation_counts().realtime;
        }).join();
        INFO(name_of(level) << (rolling ? ", rolling shutter" : ""));
        CHECK(allocations == 0);
        FrameQuality quality;
        frame.describe(quality, {electrons_per_j_m2, 1, noise});
        CHECK(quality.level_share[static_cast<std::size_t>(level)] == 1);
        CHECK(*std::min_element(image.begin(), image.end()) >= 0);
        CHECK_FALSE(frame.is_whole());
    }
}

TEST_CASE("the levels of frames made of earlier ones give them again") {
    const scene::Scene scene = moving_scene();
    Rig rig(scene, 2 * ns_per_ms), other(scene, 2 * ns_per_ms, 2);
    rig.keep_frames();
    other.keep_frames();
    static_cast<void>(rig.full(1));
    const Time begin = rig.clock.now();
    static_cast<void>(rig.full(1));
    const auto cost_ns = static_cast<double>(rig.clock.now() - begin);
    std::array<int, quality_level_count> frames{};
    int partly = 0;
    std::uint64_t id = 0;
    const auto shoot = [&](double budget) {
        rig.expose_at(mid_of(++id));
        other.expose_at(mid_of(id));
        const Shot shot = rig.shot(id, static_cast<std::int64_t>(budget * cost_ns));
        INFO("frame " << id << ", budget " << budget << " of full rendering");
        CHECK((other.again(id, shot.quality) == shot.image));
        const bool biased =
            std::any_of(shot.quality.group_level.begin(),
                        shot.quality.group_level.begin() + shot.quality.groups, obscura::is_biased);
        CHECK(biased == (shot.quality.rows_reprojected + shot.quality.rows_repeated > 0));
        if (biased) CHECK((shot.quality.reasons & quality_budget) != 0);
        ++frames[static_cast<std::size_t>(shot.quality.level_max)];
        partly += biased && shot.quality.rows_reprojected + shot.quality.rows_repeated < size ? 1 : 0;
    };
    for (int f = 0; f < 10; ++f)
        shoot(3);
    for (int cycle = 0; cycle < 6; ++cycle)
        for (const double budget : {3.0, 0.5, 0.3, 0.2, 0.15, 0.8, 0.1, 0.02, 0.001, 1.2})
            shoot(budget);
    INFO("worst level, frames: " << frames[7] << " reprojected, " << frames[8] << " repeated, " << partly
                                 << " in part");
    CHECK(frames[static_cast<std::size_t>(QualityLevel::reprojected)] > 3);
    CHECK(frames[static_cast<std::size_t>(QualityLevel::repeated)] > 0);
    CHECK(frames[static_cast<std::size_t>(QualityLevel::sixteenth)] > 0);
    CHECK(partly > 0);
}

} // namespace earlier_light_test
