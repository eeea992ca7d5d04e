// SPDX-License-Identifier: Apache-2.0
// The bound of how far the light of lamps moves, against beams and shadows followed one by one.
#include "renderer/materials/lambert.hpp"
#include "renderer/renderer.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

namespace lamp_change_test {

using namespace obscura;

namespace {

constexpr double radius_m = 10;
constexpr double range_m = 1000;
constexpr double pixel_rad = 1e-4;

/// A ball at the origin, a camera that looks at it, and a lamp.
scene::Scene lit_ball(scene::Lamp::Beam beam) {
    scene::Scene s;
    s.camera.width = s.camera.height = 512;
    s.camera.pixel_pitch_m = 5e-6;
    s.camera.focal_length_m = s.camera.pixel_pitch_m / pixel_rad;
    s.camera.motion.samples[0].pose = {{-range_m, 0, 0}, look_along({1, 0, 0}, {0, 0, 1})};
    s.bodies.push_back({"ball",
                        renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}},
                        renderer::LambertParameters{0.3},
                        {}});
    scene::Lamp lamp;
    lamp.name = "lamp";
    lamp.beam = beam;
    lamp.intensity_w_sr = {1};
    s.lamps.push_back(lamp);
    return s;
}

double change_px(const renderer::Renderer& r, const Pose& from, const Pose& to) {
    GroundTruth truth;
    r.fill_truth(Time{}, truth);
    return r.lamp_change_px(truth, std::array{from}, truth, std::array{to});
}

/// Way from a to b across the ray from `light` to a, as pixels of the camera at most.
double across_px(Vec3 light, Vec3 a, Vec3 b) {
    const Vec3 d = normalized(a - light);
    return length(cross(b - a, d)) / (range_m - radius_m) / pixel_rad;
}

} // namespace

TEST_CASE("light that does not move changes nothing, and neither does a lamp without axis that turns") {
    const Pose pose{{-100, 20, 0}, look_along({1, 0, 0}, {0, 0, 1})};
    const Pose turned{pose.position_m, look_along({1, 0.1, 0}, {0, 0, 1})};
    const renderer::Renderer point(lit_ball(scene::Lamp::Beam::point), {});
    CHECK(change_px(point, pose, pose) == 0);
    CHECK(change_px(point, pose, turned) == 0);
    const renderer::Renderer spot(lit_ball(scene::Lamp::Beam::gaussian), {});
    CHECK(change_px(spot, pose, pose) == 0);
    // At the ball's centre a spot moves by 0.1 rad of 102 m; the bound is for its far side.
    const double centre_px = std::atan(0.1) * length(pose.position_m) / range_m / pixel_rad;
    CHECK(change_px(spot, pose, turned) > centre_px);
    CHECK(change_px(spot, pose, turned) < 1.3 * centre_px);
}

TEST_CASE("no beam and no shadow on a body moves further than the bound") {
    const renderer::Renderer r(lit_ball(scene::Lamp::Beam::uniform), {});
    std::mt19937 engine(5);
    std::normal_distribution<double> normal;
    const auto vector = [&] { return Vec3{normal(engine), normal(engine), normal(engine)}; };
    double nearest = 0;
    for (int i = 0; i < 2000; ++i) {
        const Vec3 place = normalized(vector()) * (15 + 200 * std::abs(normal(engine)));
        const Vec3 target = normalized(vector()) * 0.7 * radius_m;
        const Vec3 up = normalized(vector());
        const Pose from{place, look_along(target - place, up)};
        const Pose to{place + vector() * 0.1, look_along(target + vector() * 0.1 - place, up)};
        const double bound = change_px(r, from, to);
        // The middle of the beam on a screen through the target, across the beam.
        const Vec3 axis = normalized(target - place);
        const Vec3 moved = rotate(to.orientation, {0, 0, 1});
        const Vec3 spot = to.position_m + moved * (dot(target - to.position_m, axis) / dot(moved, axis));
        const double beam_px = across_px(place, target, spot);
        // The shadow of a point of the body on such a screen, where it stands behind that point.
        const Vec3 caster = normalized(vector()) * radius_m * 0.9;
        double shadow_px = 0;
        if (const Vec3 ray = normalized(caster - place); dot(target - caster, ray) > 0) {
            const auto shadow_of = [&](Vec3 lamp) {
                return lamp + (caster - lamp) * (dot(target - lamp, ray) / dot(caster - lamp, ray));
            };
            shadow_px = across_px(place, shadow_of(place), shadow_of(to.position_m));
        }
        CAPTURE(i, beam_px, shadow_px);
        // To first order: the motions are small.
        CHECK(beam_px <= 1.02 * bound);
        CHECK(shadow_px <= 1.02 * bound);
        nearest = std::max(nearest, beam_px / bound);
    }
    CHECK(nearest > 0.5);
}

} // namespace lamp_change_test
