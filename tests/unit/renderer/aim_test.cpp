// SPDX-License-Identifier: Apache-2.0
// A camera and lamps that are aimed at a body or a point while everything moves.
#include "core/error.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/world/build.hpp"
#include "renderer/world/kinematics.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <memory>
#include <string>
#include <vector>

namespace aim_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;

namespace {

/// Ball of 1 km in radius.
scene::Body ball(const std::string& name) {
    return {name, EllipsoidParameters{{1e3, 1e3, 1e3}}, LambertParameters{0.5}, {}};
}

void check_near(Vec3 a, Vec3 b, double tolerance = 1e-12) {
    CHECK_THAT(a.x, WithinAbs(b.x, tolerance));
    CHECK_THAT(a.y, WithinAbs(b.y, tolerance));
    CHECK_THAT(a.z, WithinAbs(b.z, tolerance));
}

Vec3 boresight(const Pose& pose) {
    return rotate(pose.orientation, {0, 0, 1});
}
Vec3 image_up(const Pose& pose) {
    return rotate(pose.orientation, {0, -1, 0});
}

/// A moving camera that is aimed at the second of two moving bodies.
scene::Scene chase() {
    scene::Scene s;
    s.bodies = {ball("other"), ball("target")};
    s.bodies[1].motion.samples = {{0, {{1e9, 0, 0}, {}}}, {100, {{1e9, 4e6, -1e6}, {}}}};
    s.camera.motion.samples = {{0, {{0, 0, 0}, {}}}, {50, {{0, -1e6, 2e6}, {}}}};
    s.camera.motion.aim = scene::Aim{.body = "target", .up = {0, 0, 1}};
    return s;
}

} // namespace

TEST_CASE("an aimed camera has the body at its principal point, by light time and aberration too") {
    scene::Scene s = chase();
    s.camera.principal_offset_px = {3.5, -7};
    for (const bool light_time : {false, true})
        for (const bool aberration : {false, true}) {
            s.light_time = light_time;
            s.aberration = aberration;
            const std::vector<BuiltBody> built = build_bodies(s);
            const std::unique_ptr<Projection> lens = make_projection(s.camera);
            for (const double t : {-5.0, 0.0, 12.3, 50.0, 70.0}) {
                const Pose camera = camera_pose(s, built, t);
                const Vec3 seen = seen_pose(s, built, 1, camera.position_m, t).position_m;
                const MovingLens moving(*lens, camera_beta(s, built, t));
                const auto at =
                    moving.project(rotate(conjugate(camera.orientation), seen - camera.position_m));
                REQUIRE(at);
                CHECK_THAT(at->x, WithinAbs(511.5 + 3.5, 1e-6));
                CHECK_THAT(at->y, WithinAbs(511.5 - 7, 1e-6));
                // Up is in the plane of the view and the wanted direction.
                const Vec3 up = rotate(conjugate(camera.orientation), {0, 0, 1});
                CHECK_THAT(up.x, WithinAbs(0, 1e-12));
                CHECK(up.y < -0.9);
            }
        }
    // Without the corrections the view is along the straight line between the two.
    s.light_time = s.aberration = false;
    const std::vector<BuiltBody> built = build_bodies(s);
    check_near(boresight(camera_pose(s, built, 25)),
               normalized(Vec3{1e9, 1e6, -0.25e6} - Vec3{0, -0.5e6, 1e6}));
    // The frame's ground truth has this pose.
    GroundTruth truth;
    Renderer(s, {1, 1, 1}).fill_truth({25'000'000'000}, truth);
    CHECK(truth.camera == camera_pose(s, built, 25));
}

TEST_CASE("every row of an aimed camera is aimed at its own time") {
    // A glowing ball that flies round the camera within one readout: the picture is that of a ball at rest.
    scene::Scene s;
    s.bodies = {ball("target")};
    s.bodies[0].emission_w_m2_sr = {1};
    s.sun.irradiance_scale = 0;
    s.camera = camera_at({-1e5, 0, 0}, 48, 0.01 / 14);
    const Image still = render(Renderer(s, {64, 1, 1}));
    scene::Body orbit = s.bodies[0];
    s.camera.motion = {};
    s.camera.motion.aim = scene::Aim{.body = "target", .up = {0, 0, 1}};
    s.bodies[0].parent = "hub";
    s.bodies[0].motion.samples = {{0, {{1e5, 0, 0}, {}}}};
    s.bodies.push_back(ball("hub"));
    s.bodies[1].shape = EllipsoidParameters{{1e-3, 1e-3, 1e-3}};
    s.bodies[1].motion.samples = {{0, {{0, 0, -1}, {}}}};
    s.bodies[1].motion.spin_rate_rad_s = 6;
    const Renderer moving(s, {64, 1, 1});
    std::vector<RowTime> times;
    for (int y = 0; y < 48; ++y)
        times.push_back({Time{y * 20'000'000}, Time{y * 20'000'000}});
    std::vector<float> image(48 * 48);
    RenderRequest request;
    request.window = {0, 0, 48, 48};
    request.rows = 48;
    request.row_times = times;
    request.frame_id = 1;
    moving.render(request, image);
    double most = 0;
    for (const float v : still.values)
        most = std::max(most, static_cast<double>(v));
    CHECK(most > 0);
    double worst = 0;
    double sum = 0;
    for (std::size_t i = 0; i < image.size(); ++i) {
        worst =
            std::max(worst, std::abs(static_cast<double>(image[i]) - static_cast<double>(still.values[i])));
        sum += static_cast<double>(image[i]);
    }
    // The noise of 64 samples at the limb; the hub, 1 m below the camera, shifts the ball by 0.014 px.
    CHECK(worst < 0.25 * most);
    CHECK_THAT(sum, Catch::Matchers::WithinRel(still.sum(), 0.003));
    CHECK(still.sum() > 100 * most);
}

TEST_CASE("where the view is parallel to up, a defined axis takes its place") {
    scene::Scene s;
    s.camera.motion.samples = {{0, {{0, 0, 10}, {}}}};
    const auto pose = [&](Vec3 point, Vec3 up) {
        s.camera.motion.aim = scene::Aim{.point_m = point, .up = up};
        return camera_pose(s, {}, 0);
    };
    check_near(boresight(pose({0, 0, 0}, {0, 0, 1})), {0, 0, -1});
    check_near(image_up(pose({0, 0, 0}, {0, 0, 1})), {1, 0, 0});
    check_near(image_up(pose({0, 0, 20}, {0, 0, 1})), {1, 0, 0});
    check_near(image_up(pose({7, 0, 10}, {3, 0, 0})), {0, 1, 0});
    // 1e-3 rad off, `up` itself counts.
    check_near(image_up(pose({0, 0.01, 0}, {0, 0, 1})), {0, 1, 0}, 0.01);
    // At the target itself there is no direction: the motion's own attitude stays.
    CHECK(pose({0, 0, 10}, {0, 0, 1}).orientation == Quat{});
}

TEST_CASE("a camera on a turning body is aimed, with up in the body's frame") {
    scene::Scene s = chase();
    s.bodies.push_back(ball("bus"));
    s.bodies[2].motion.samples = {{0, {{5, 6, 7}, axis_angle({1, 0, 0}, 0.4)}}};
    s.bodies[2].motion.spin_rate_rad_s = 0.3;
    s.camera.motion.samples = {{0, {{1, 0, 0}, {}}}};
    s.camera.parent = "bus";
    const std::vector<BuiltBody> built = build_bodies(s);
    for (const double t : {0.0, 4.0, 30.0}) {
        const Pose bus = body_pose(s, built, 2, t);
        const Pose camera = camera_pose(s, built, t);
        check_near(camera.position_m, to_parent(bus, {1, 0, 0}));
        check_near(boresight(camera), normalized(body_pose(s, built, 1, t).position_m - camera.position_m));
        const Vec3 up = rotate(conjugate(camera.orientation), rotate(bus.orientation, {0, 0, 1}));
        CHECK_THAT(up.x, WithinAbs(0, 1e-12));
        CHECK(up.y < 0);
    }
    // A point is one of the body's frame.
    s.camera.motion.aim = scene::Aim{.point_m = {1, 0, -8}, .up = {1, 0, 0}};
    check_near(boresight(camera_pose(s, built, 4)),
               rotate(body_pose(s, built, 2, 4).orientation, {0, 0, -1}));
}

TEST_CASE("lamps are aimed, at the Sun too, and poses from outside count more") {
    class Outside final : public scene::LivePose {
    public:
        bool at(double time_s, Pose& pose) const noexcept override {
            if (time_s < 10) return false;
            pose = {{1, 2, 3}, axis_angle({0, 1, 0}, 0.5)};
            return true;
        }
    };
    scene::Scene s = chase();
    s.sun.position_m = {3e10, 4e10, 0};
    scene::Lamp lamp;
    lamp.motion.aim = scene::Aim{.body = "target"};
    s.lamps = {lamp, lamp};
    s.lamps[1].motion.aim->body = scene::sun_name;
    const std::vector<BuiltBody> built = build_bodies(s);
    check_near(boresight(lamp_pose(s, built, s.lamps[0], 50)), normalized(Vec3{1e9, 2e6, -0.5e6}));
    check_near(boresight(lamp_pose(s, built, s.lamps[1], 50)), {0.6, 0.8, 0});
    s.camera.motion.live = std::make_shared<Outside>();
    check_near(boresight(camera_pose(s, built, 0)), {1, 0, 0});
    CHECK(camera_pose(s, built, 20) == Pose{{1, 2, 3}, axis_angle({0, 1, 0}, 0.5)});
}

TEST_CASE("an aim at what does not exist is refused with the names that there are") {
    const auto refusal = [](const scene::Scene& s) {
        try {
            const Renderer r(s, {});
        } catch (const ConfigError& e) {
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    scene::Scene s = chase();
    s.camera.motion.aim->body = "asteroid";
    CHECK(refusal(s) ==
          "camera: look_at: \"asteroid\" is no body or landmark of the scene; there are other, target, sun");
    s.camera.motion.aim = scene::Aim{.up = {0, 0, 0}};
    CHECK(refusal(s) == "camera: the aim needs a point within 1e15 m and an \"up\" that is not zero");
}

} // namespace aim_test
