// SPDX-License-Identifier: Apache-2.0
// Bodies on bodies: poses against matrices multiplied out, joints from tables and from outside, instances.
#include "core/error.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/world/build.hpp"
#include "renderer/world/kinematics.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

namespace kinematics_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;

namespace {

scene::Body box(const std::string& name, Vec3 size, const std::string& parent = {}) {
    scene::Body b{name, renderer::BoxParameters{size}, renderer::LambertParameters{0.5}, {}};
    b.parent = parent;
    return b;
}

std::string refusal(const std::vector<scene::Body>& bodies) {
    try {
        scene::Scene s;
        s.bodies = bodies;
        (void)scene::parents_of(s);
    } catch (const ConfigError& e) {
        return e.what();
    }
    return "accepted";
}

void check_near(Vec3 a, Vec3 b, double tolerance = 1e-12) {
    CHECK_THAT(a.x, WithinAbs(b.x, tolerance));
    CHECK_THAT(a.y, WithinAbs(b.y, tolerance));
    CHECK_THAT(a.z, WithinAbs(b.z, tolerance));
}

class FixedPose final : public scene::LivePose {
public:
    explicit FixedPose(Pose pose) : pose_(pose) {}
    bool at(double /*time_s*/, Pose& pose) const noexcept override {
        pose = pose_;
        return true;
    }

private:
    Pose pose_;
};

} // namespace

TEST_CASE("Velocities are the derivatives of positions, through turns, slides and parents") {
    scene::Scene s;
    s.bodies = {box("planet", {1, 1, 1}), box("mast", {1, 1, 1}, "planet"), box("moon", {1, 1, 1}, "planet"),
                box("pack", {1, 1, 1}, "mast")};
    s.bodies[0].motion.samples = {{0, {{0, 0, 0}, {}}}, {10, {{100, 20, 0}, axis_angle({1, 0, 0}, 0.5)}}};
    s.bodies[0].motion.spin_rate_rad_s = 0.3;
    s.bodies[1].motion.samples = {{0, {{0, 3, 1}, {}}}, {20, {{0, 5, 1}, axis_angle({0, 1, 0}, 1)}}};
    s.bodies[2].motion.inertial_axes = true;
    s.bodies[2].motion.samples = {{0, {{0, 50, 0}, {}}}, {10, {{0, 50, 20}, {}}}};
    s.bodies[3].joint = {scene::Joint::Kind::slide, {0, 0, 1}, {{0, 0}, {10, 4}}};
    s.bodies[3].motion.samples[0].pose.position_m = {2, 0, 0};
    s.camera.parent = "pack";
    s.camera.motion.samples[0].pose.position_m = {0, 0, 7};
    const std::vector<BuiltBody> built = build_bodies(s);
    constexpr double h = 1e-4;
    for (const double t : {1.0, 4.0, 9.0, 15.0}) {
        INFO(t);
        for (std::size_t b = 0; b < built.size(); ++b)
            check_near(body_velocity_m_s(s, built, b, t),
                       (body_pose(s, built, b, t + h).position_m - body_pose(s, built, b, t - h).position_m) /
                           (2 * h),
                       1e-3);
        check_near(camera_velocity_m_s(s, built, t),
                   (camera_pose(s, built, t + h).position_m - camera_pose(s, built, t - h).position_m) /
                       (2 * h),
                   1e-3);
    }
    // At the ends of a table the velocity is that within; beyond, it holds.
    CHECK(body_velocity_m_s(s, built, 0, 0) == Vec3{10, 2, 0});
    CHECK(body_velocity_m_s(s, built, 0, 10) == Vec3{10, 2, 0});
    CHECK(body_velocity_m_s(s, built, 0, 10.001) == Vec3{0, 0, 0});
    CHECK(body_velocity_m_s(s, built, 0, -0.001) == Vec3{0, 0, 0});
}

TEST_CASE("What counts from a body with inertial axes goes with it and does not turn with it") {
    scene::Scene s;
    s.bodies = {box("planet", {1, 1, 1}), box("moon", {1, 1, 1}, "planet"), box("crater", {1, 1, 1}, "moon")};
    s.bodies[0].motion.samples = {{0, {{0, 0, 0}, {}}}, {10, {{100, 0, 0}, {}}}};
    s.bodies[0].motion.spin_rate_rad_s = 0.3;
    s.bodies[1].motion.inertial_axes = true;
    s.bodies[1].motion.samples = {{0, {{0, 50, 0}, {}}}, {10, {{0, 50, 20}, {}}}};
    s.bodies[1].motion.spin_rate_rad_s = 0.2;
    s.bodies[2].motion.samples[0].pose.position_m = {2, 0, 0};
    s.camera.parent = "moon";
    s.camera.motion.inertial_axes = true;
    s.camera.motion.samples[0].pose.position_m = {0, 0, 7};
    s.camera.motion.aim = scene::Aim{.body = "", .point_m = {0, 1, 7}, .up = {0, 0, 1}};
    const std::vector<BuiltBody> built = build_bodies(s);
    for (const double t : {0.0, 3.0, 10.0}) {
        const Vec3 moon = Vec3{10 * t, 50, 2 * t};
        check_near(body_pose(s, built, 1, t).position_m, moon);
        check_near(rotate(body_pose(s, built, 1, t).orientation, {1, 0, 0}),
                   {std::cos(0.2 * t), std::sin(0.2 * t), 0});
        check_near(body_pose(s, built, 2, t).position_m,
                   moon + Vec3{2 * std::cos(0.2 * t), 2 * std::sin(0.2 * t), 0});
        const Pose camera = camera_pose(s, built, t);
        check_near(camera.position_m, moon + Vec3{0, 0, 7});
        check_near(rotate(camera.orientation, {0, 0, 1}), {0, 1, 0});
    }
}

TEST_CASE("An arm of three links stands where plane trigonometry puts it") {
    // Upper arm on a turning base, forearm 2 m along it on a hinge, a slide at the forearm's end.
    scene::Scene s;
    s.bodies = {box("hand", {1, 1, 1}, "forearm"), box("base", {1, 1, 1}), box("forearm", {1, 1, 1}, "base")};
    s.bodies[1].motion.samples[0].pose.position_m = {10, 20, 30};
    s.bodies[1].motion.spin_axis = {0, 0, 1};
    s.bodies[1].motion.spin_rate_rad_s = 0.1;
    s.bodies[2].motion.samples[0].pose.position_m = {2, 0, 0};
    s.bodies[2].joint = {scene::Joint::Kind::hinge, {0, 0, 5}, {{0, 0}, {10, 1}}};
    s.bodies[0].motion.samples[0].pose.position_m = {3, 0, 0};
    s.bodies[0].joint = {scene::Joint::Kind::slide, {0, 2, 0}, {{2, 0.5}, {4, 1.5}}};
    const std::vector<BuiltBody> built = build_bodies(s);
    for (const double t : {-1.0, 0.0, 3.0, 7.0, 12.0}) {
        const double base = 0.1 * t;
        const double fore = base + std::clamp(t / 10, 0.0, 1.0);
        const double slid = std::clamp(0.5 + (t - 2) / 2, 0.5, 1.5);
        const Vec3 elbow = Vec3{10, 20, 30} + 2 * Vec3{std::cos(base), std::sin(base), 0};
        const Vec3 hand = elbow + 3 * Vec3{std::cos(fore), std::sin(fore), 0} +
                          slid * Vec3{-std::sin(fore), std::cos(fore), 0};
        check_near(body_pose(s, built, 2, t).position_m, elbow);
        check_near(body_pose(s, built, 0, t).position_m, hand);
        check_near(rotate(body_pose(s, built, 0, t).orientation, {1, 0, 0}),
                   {std::cos(fore), std::sin(fore), 0});
    }
    // The truth of a frame tells inertial poses.
    const renderer::Renderer r(s, {1, 1, 1});
    GroundTruth truth;
    r.fill_truth({7'000'000'000}, truth);
    check_near(truth.bodies[0].pose.position_m, body_pose(s, built, 0, 7).position_m, 1e-9);
}

TEST_CASE("Of a pose from outside a joint takes what it can do, fixed bodies take it all") {
    const Pose live{{1, 2, 3}, axis_angle({0, 0, 1}, 0.7) * axis_angle({1, 0, 0}, 0.2)};
    scene::Scene s;
    s.bodies = {box("base", {1, 1, 1}), box("child", {1, 1, 1}, "base")};
    s.bodies[0].motion.samples[0].pose = {{0, 0, 100}, axis_angle({0, 1, 0}, 0.3)};
    scene::Body& child = s.bodies[1];
    const Pose mount{{5, 0, 0}, axis_angle({1, 0, 0}, 0.4)};
    child.motion.samples[0].pose = mount;
    child.motion.live = std::make_shared<FixedPose>(live);
    const auto in_base = [&] {
        const std::vector<BuiltBody> built = build_bodies(s);
        const Pose base = body_pose(s, built, 0, 0);
        const Pose p = body_pose(s, built, 1, 0);
        return Pose{to_local(base, p.position_m), conjugate(base.orientation) * p.orientation};
    };
    check_near(in_base().position_m, live.position_m);
    check_near(rotate(in_base().orientation, {1, 2, 3}), rotate(live.orientation, {1, 2, 3}));
    child.joint = {scene::Joint::Kind::slide, {0, 3, 0}, {}};
    const Vec3 axis = rotate(mount.orientation, {0, 1, 0});
    check_near(in_base().position_m, mount.position_m + axis * dot(axis, live.position_m - mount.position_m));
    check_near(rotate(in_base().orientation, {1, 2, 3}), rotate(mount.orientation, {1, 2, 3}));
    // A pure turn about the hinge comes through whole.
    child.joint = {scene::Joint::Kind::hinge, {0, 0, 1}, {}};
    child.motion.live =
        std::make_shared<FixedPose>(Pose{{9, 9, 9}, mount.orientation * axis_angle({0, 0, 1}, -2.5)});
    check_near(in_base().position_m, mount.position_m);
    check_near(rotate(in_base().orientation, {1, 2, 3}),
               rotate(mount.orientation * axis_angle({0, 0, 1}, -2.5), {1, 2, 3}));
}

TEST_CASE("Camera and lamps hang on bodies") {
    scene::Scene s;
    s.bodies = {box("bus", {1, 1, 1}), box("mast", {0.1, 0.1, 3}, "bus"), box("target", {2, 2, 2})};
    s.bodies[0].motion.samples[0].pose.position_m = {10, 20, 30};
    s.bodies[0].motion.spin_rate_rad_s = 0.1;
    s.bodies[1].motion.samples[0].pose.position_m = {0, 0, 5};
    s.bodies[1].joint = {scene::Joint::Kind::slide, {0, 0, 1}, {{0, 0}, {10, 2}}};
    s.bodies[2].motion.samples[0].pose.position_m = {10, 20, -100};
    // A camera on the mast, 1 m along x, that a hinge turns by 0.3 rad; a lamp on the bus that slides along
    // y.
    s.camera.parent = "mast";
    s.camera.motion.samples[0].pose.position_m = {1, 0, 0};
    s.camera.joint = {scene::Joint::Kind::hinge, {0, 0, 1}, {{0, 0.3}}};
    scene::Lamp lamp;
    lamp.parent = "bus";
    lamp.motion.samples[0].pose.position_m = {0, 1, 0};
    lamp.joint = {scene::Joint::Kind::slide, {0, 1, 0}, {{0, 0}, {10, 5}}};
    lamp.intensity_w_sr = {1};
    s.lamps.push_back(lamp);
    const auto built = build_bodies(s);
    for (const double t : {0.0, 4.0, 10.0, 12.0}) {
        const double turn = 0.1 * t;
        const double along = std::min(t, 10.0) / 10;
        const Pose camera = camera_pose(s, built, t);
        check_near(camera.position_m, {10 + std::cos(turn), 20 + std::sin(turn), 35 + 2 * along});
        check_near(rotate(camera.orientation, {1, 0, 0}), {std::cos(turn + 0.3), std::sin(turn + 0.3), 0});
        const Pose light = lamp_pose(s, built, s.lamps[0], t);
        const double out = 1 + 5 * along;
        check_near(light.position_m, {10 - out * std::sin(turn), 20 + out * std::cos(turn), 30});
    }
    // The picture is the one from the pose worked out by hand.
    s.camera.width = s.camera.height = 32;
    s.camera.focal_length_m = 0.01;
    s.camera.motion.samples[0].pose.orientation = look_along({0, 0, -1}, {0, 1, 0});
    s.camera.joint = {};
    scene::Scene by_hand = s;
    by_hand.camera.parent.clear();
    by_hand.camera.motion.samples[0].pose = {{10 + std::cos(0.4), 20 + std::sin(0.4), 35.8},
                                             axis_angle({0, 0, 1}, 0.4) *
                                                 s.camera.motion.samples[0].pose.orientation};
    const Time four = Time{4'000'000'000};
    const Image hung = render(renderer::Renderer(s, {}), 1, four);
    const Image wanted = render(renderer::Renderer(by_hand, {}), 1, four);
    CHECK(wanted.sum() > 0);
    CHECK_THAT(hung.sum(), Catch::Matchers::WithinRel(wanted.sum(), 1e-6));

    const auto complaint = [&](const std::string& parent) {
        s.lamps[0].parent = parent;
        try {
            const renderer::Renderer r(s, {});
        } catch (const ConfigError& e) {
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    CHECK(complaint("lander") == "lamp '': its parent 'lander' is no body of the scene");
    s.camera.parent = "camera";
    CHECK(complaint("bus") == "camera: parents go in a circle: camera -> camera");
}

TEST_CASE("Circles of parents are named, and other impossible trees") {
    CHECK(refusal({box("a", {1, 1, 1}), box("b", {1, 1, 1}, "a")}) == "accepted");
    CHECK(refusal({box("a", {1, 1, 1}, "a")}) == "body 'a': parents go in a circle: a -> a");
    CHECK(refusal({box("tip", {1, 1, 1}, "a"), box("a", {1, 1, 1}, "b"), box("b", {1, 1, 1}, "c"),
                   box("c", {1, 1, 1}, "a")}) == "body 'tip': parents go in a circle: c -> a -> b -> c");
    CHECK(refusal({box("a", {1, 1, 1}, "z")}) == "body 'a': its parent 'z' is no body of the scene");
    scene::Body b = box("a", {1, 1, 1});
    b.joint = {scene::Joint::Kind::hinge, {0, 0, 0}, {}};
    CHECK(refusal({b}) == "body 'a': its joint needs a finite axis that is not zero");
    b.joint = {scene::Joint::Kind::hinge, {0, 0, 1}, {{0, 1}, {0, 2}}};
    CHECK(refusal({b}) == "body 'a': time of value 2 of its joint is not later than that of value 1");
    b.joint = {scene::Joint::Kind::hinge, {0, 0, 1}, {{0, std::nan("")}}};
    CHECK(refusal({b}) == "body 'a': value 1 of its joint is not finite");
}

TEST_CASE("Bodies of one file share its mesh") {
    const TempFolder folder;
    const std::string file = folder.write("t.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").string();
    scene::Scene s;
    for (const char* name : {"a", "b", "c"})
        s.bodies.push_back(
            {name, renderer::MeshFileParameters{file, 1, true}, renderer::LambertParameters{0.5}, {}});
    s.bodies[2].shape.get<renderer::MeshFileParameters>().metres_per_unit = 2;
    const std::vector<BuiltBody> built = build_bodies(s);
    CHECK(built[0].shape.get() == built[1].shape.get());
    CHECK(built[0].shape.get() != built[2].shape.get());
}

TEST_CASE("Bodies and lamps hang on the camera, which may hang on a body itself") {
    scene::Scene s;
    s.bodies = {box("bus", {1, 1, 1}), box("arm", {1, 1, 1}, "camera"), box("hand", {1, 1, 1}, "arm"),
                box("target", {1, 1, 1})};
    s.bodies[0].motion.samples = {{0, {{0, 0, 0}, {}}}, {10, {{100, 20, 0}, axis_angle({1, 0, 0}, 0.5)}}};
    s.bodies[1].motion.samples[0].pose = {{0.2, 0.1, 1}, axis_angle({0, 1, 0}, 0.3)};
    s.bodies[2].motion.samples[0].pose.position_m = {0, 0, 0.5};
    s.bodies[3].motion.samples[0].pose.position_m = {30, -400, 20};
    s.camera.parent = "bus";
    s.camera.motion.samples[0].pose.position_m = {0, 2, 0};
    s.camera.motion.aim = scene::Aim{.body = "target", .up = {0, 0, 1}};
    s.lamps.emplace_back();
    s.lamps[0].parent = "camera";
    s.lamps[0].motion.samples[0].pose.position_m = {0.1, 0, 0};
    s.lamps[0].intensity_w_sr = {1};
    const std::vector<BuiltBody> built = build_bodies(s);
    constexpr double h = 1e-4;
    for (const double t : {0.0, 3.0, 8.0}) {
        INFO(t);
        const Pose camera = camera_pose(s, built, t);
        const Pose arm{camera.position_m + to_matrix(camera.orientation) * Vec3{0.2, 0.1, 1},
                       camera.orientation * axis_angle({0, 1, 0}, 0.3)};
        check_near(body_pose(s, built, 1, t).position_m, arm.position_m);
        check_near(rotate(body_pose(s, built, 1, t).orientation, {1, 2, 3}),
                   rotate(arm.orientation, {1, 2, 3}));
        check_near(body_pose(s, built, 2, t).position_m,
                   arm.position_m + to_matrix(arm.orientation) * Vec3{0, 0, 0.5});
        check_near(lamp_pose(s, built, s.lamps[0], t).position_m,
                   camera.position_m + to_matrix(camera.orientation) * Vec3{0.1, 0, 0});
        check_near(rotate(lamp_pose(s, built, s.lamps[0], t).orientation, {0, 0, 1}),
                   rotate(camera.orientation, {0, 0, 1}));
        if (t > 0)
            check_near(body_velocity_m_s(s, built, 2, t),
                       (body_pose(s, built, 2, t + h).position_m - body_pose(s, built, 2, t - h).position_m) /
                           (2 * h),
                       1e-3);
    }
    const auto refusal_of = [](const scene::Scene& wrong) {
        try {
            (void)scene::parents_of(wrong);
        } catch (const ConfigError& e) {
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    scene::Scene wrong = s;
    wrong.camera.parent = "hand";
    CHECK(refusal_of(wrong) == "body 'arm': parents go in a circle: arm -> camera -> hand -> arm");
    wrong.camera.parent = "camera";
    CHECK(refusal_of(wrong) == "body 'arm': parents go in a circle: camera -> camera");
    wrong = s;
    wrong.camera.motion.aim->body = "hand";
    CHECK(refusal_of(wrong) == "camera: look_at: 'hand' hangs on the camera; allowed are bodies that do not");
}

} // namespace kinematics_test
