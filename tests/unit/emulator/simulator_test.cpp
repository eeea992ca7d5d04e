// SPDX-License-Identifier: Apache-2.0
// Poses from outside, and the lines they come in.
#include "core/philox.hpp"
#include "emulator/render/pose_ring.hpp"
#include "emulator/simulator/simulator_protocol.hpp"
#include "emulator/simulator/simulator_server.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/emulator/bench.hpp"

#include <atomic>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

namespace simulator_test {

using namespace obscura;
using namespace obscura::emulator;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

std::string why(std::string_view line) {
    const SimulatorLine parsed = parse_simulator_line(line);
    const auto* bad = std::get_if<BadLine>(&parsed);
    return bad == nullptr ? "" : bad->why;
}

Pose turned(double x_m, double about_z_rad) {
    return {{x_m, 0, 0}, axis_angle({0, 0, 1}, about_z_rad)};
}

} // namespace

TEST_CASE("lines of the simulator") {
    const SimulatorLine pose = parse_simulator_line("pose lander 12.25 1 -2.5 3e3 1 0 0 0");
    const auto& p = std::get<PoseLine>(pose);
    CHECK(p.name == "lander");
    CHECK(p.time == Time{12'250'000'000});
    CHECK(p.pose.position_m == Vec3{1, -2.5, 3000});
    CHECK(p.pose.orientation == Quat{1, 0, 0, 0});
    CHECK(std::get<StepLine>(parse_simulator_line("step 0.000000001")).time == Time{1});
    CHECK(std::holds_alternative<StateLine>(parse_simulator_line(" state ")));
    CHECK(seconds_text(Time{12'250'000'001}) == "12.250000001");

    CHECK_THAT(why("pose"), ContainsSubstring("name"));
    CHECK_THAT(why("pose a x 0 0 0 1 0 0 0"), ContainsSubstring("TIME"));
    CHECK_THAT(why("pose a 1 0 0 0 1 0 0"), ContainsSubstring("seven"));
    CHECK_THAT(why("pose a 1 0 0 nan 1 0 0 0"), ContainsSubstring("seven"));
    CHECK_THAT(why("pose a 1 0 0 inf 1 0 0 0"), ContainsSubstring("seven"));
    CHECK_THAT(why("pose a 1 0 0 1e300 1 0 0 0"), ContainsSubstring("position"));
    CHECK_THAT(why("pose a 1 0 0 0 1 1 0 0"), ContainsSubstring("quaternion"));
    CHECK_FALSE(p.rates.has_value());
    const SimulatorLine moving = parse_simulator_line("pose lander 1 0 0 0 1 0 0 0 7 -8 9 0.1 0.2 -0.3");
    CHECK(std::get<PoseLine>(moving).rates == PoseRates{{7, -8, 9}, {0.1, 0.2, -0.3}});
    CHECK_THAT(why("pose a 1 0 0 0 1 0 0 0 9"), ContainsSubstring("six numbers are wanted, or none"));
    CHECK_THAT(why("pose a 1 0 0 0 1 0 0 0 1 2 3 4 5 nan"), ContainsSubstring("six numbers"));
    CHECK_THAT(why("pose a 1 0 0 0 1 0 0 0 1 2 3 4 5 6 7"), ContainsSubstring("more words"));
    CHECK_THAT(why("pose a 1 0 0 0 1 0 0 0 2e9 0 0 0 0 0"),
               ContainsSubstring("velocity: allowed is up to 1e+09"));
    CHECK_THAT(why("pose a 1 0 0 0 1 0 0 0 0 0 0 0 0 2e4"),
               ContainsSubstring("rate: allowed is up to 10000"));
    for (const char* time : {"", "-1", "1e3", "0x1", "1000000000", "1.0000000001", "."})
        CHECK_THAT(why(std::string("step ") + time), ContainsSubstring("TIME"));
    CHECK_THAT(why("step 1 2"), ContainsSubstring("TIME"));
    CHECK_THAT(why("posse"), ContainsSubstring("allowed pose, step, state, token; did you mean \"pose\"?"));
    CHECK_THAT(why(std::string(1000, 'a')), ContainsSubstring("512"));
}

TEST_CASE("no bytes do harm") {
    const std::string words[] = {"pose", "step",  "state", " ",      "1",   "-",
                                 ".",    "1e999", "\t",    "camera", "nan", "0.5"};
    for (std::uint32_t n = 0; n < 20'000; ++n) {
        std::string line;
        for (std::uint32_t i = 0; i < 12; ++i) {
            const auto r = philox4x32({n, i, 0, 0}, {5, 6});
            if (r[0] % 3 == 0)
                line += static_cast<char>(r[1]);
            else
                line += words[r[1] % std::size(words)];
            if (r[2] % 2 == 0) line += ' ';
        }
        const SimulatorLine parsed = parse_simulator_line(line);
        if (const auto* pose = std::get_if<PoseLine>(&parsed)) {
            CHECK(is_finite(pose->pose.position_m));
            CHECK_THAT(norm(pose->pose.orientation), WithinAbs(1, 1e-9));
        }
    }
}

TEST_CASE("between poses there is interpolation, past the last one a limited extrapolation") {
    PoseRing ring(0.5);
    Pose pose;
    CHECK_FALSE(ring.at(0, pose));
    REQUIRE(ring.push(1, turned(10, 0)));
    REQUIRE(ring.at(99, pose));
    CHECK(pose.position_m.x == 10);
    REQUIRE(ring.push(2, turned(20, 0.2)));
    REQUIRE(ring.push(4, turned(30, 0.4)));
    CHECK_FALSE(ring.push(4, turned(0, 0)));
    CHECK_FALSE(ring.push(3, turned(0, 0)));
    CHECK_FALSE(ring.push(std::nan(""), turned(0, 0)));
    const auto check = [&](double time_s, double x_m, double angle_rad) {
        REQUIRE(ring.at(time_s, pose));
        CHECK_THAT(pose.position_m.x, WithinAbs(x_m, 1e-12));
        CHECK_THAT(2 * std::atan2(pose.orientation.z, pose.orientation.w), WithinAbs(angle_rad, 1e-12));
    };
    check(0, 10, 0);
    check(1, 10, 0);
    check(1.5, 15, 0.1);
    check(2, 20, 0.2);
    check(3, 25, 0.3);
    check(4, 30, 0.4);
    check(4.25, 31.25, 0.425); // 5 m/s and 0.1 rad/s go on
    check(4.5, 32.5, 0.45);
    check(100, 32.5, 0.45); // and hold
}

TEST_CASE("after the newest pose the motion goes on with the stated rates, and the age grows") {
    PoseRing ring(0.5);
    Pose pose;
    CHECK(ring.age_s(7) == 0);
    const auto check = [&](double time_s, double x_m, double angle_rad, double age_s) {
        REQUIRE(ring.at(time_s, pose));
        CHECK_THAT(pose.position_m.x, WithinAbs(x_m, 1e-12));
        CHECK_THAT(2 * std::atan2(pose.orientation.z, pose.orientation.w), WithinAbs(angle_rad, 1e-12));
        CHECK_THAT(ring.age_s(time_s), WithinAbs(age_s, 1e-12));
    };
    REQUIRE(ring.push(1, turned(10, 0.3), PoseRates{{4, 0, 0}, {0, 0, -0.2}}));
    check(0.5, 10, 0.3, 0);
    check(1.25, 11, 0.25, 0.25);
    check(9, 12, 0.2, 8); // held after 0.5 s
    REQUIRE(ring.push(2, turned(20, 0.2), PoseRates{{-1, 0, 0}, {0, 0, 0}}));
    // Between poses with rates cubics: the mean of both ends plus an eighth of the difference of the rates.
    check(1.5, 15.625, 0.225, 0);
    check(2.25, 19.75, 0.2, 0.25);
    REQUIRE(ring.push(3, turned(30, 0.4))); // none stated: those between the last two
    check(3.25, 32.5, 0.45, 0.25);
    check(2.5, 25, 0.3, 0); // one of the two has none: linear
}

TEST_CASE("between poses with rates the motion is met to the fourth order of their distance") {
    // A thing that swings about one axis while that turns about another, on a curved path.
    const auto attitude = [](double t) {
        return axis_angle({0, 0, 1}, 0.7 * t) * axis_angle({1, 0, 0}, 0.5 * std::sin(t));
    };
    const auto rate = [](double t) {
        const double a = 0.5 * std::sin(t);
        return Vec3{0.5 * std::cos(t), 0.7 * std::sin(a), 0.7 * std::cos(a)};
    };
    const auto position = [](double t) { return Vec3{t * t * t, std::sin(t), 2 - t * t}; };
    const auto velocity = [](double t) { return Vec3{3 * t * t, std::cos(t), -2 * t}; };
    const auto worst = [&](double step_s, bool rates) {
        PoseRing ring(0);
        for (int i = 0; i <= 4; ++i) {
            const double t = i * step_s;
            REQUIRE(ring.push(t, {position(t), attitude(t)},
                              rates ? std::optional<PoseRates>({velocity(t), rate(t)}) : std::nullopt));
        }
        std::array<double, 2> most{};
        for (double t = 0; t < 4 * step_s; t += step_s / 16) {
            Pose pose;
            REQUIRE(ring.at(t, pose));
            const Quat d = conjugate(pose.orientation) * attitude(t);
            most[0] = std::max(most[0], length(pose.position_m - position(t)));
            most[1] = std::max(most[1], 2 * std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z));
        }
        return most;
    };
    const auto coarse = worst(0.4, true), fine = worst(0.2, true), linear = worst(0.2, false);
    CAPTURE(coarse, fine, linear);
    // The fourth derivative of the sine times h^4 / 384.
    CHECK(fine[0] < 0.2 * 0.2 * 0.2 * 0.2 / 384);
    for (const std::size_t part : {0, 1}) {
        CHECK(coarse[part] / fine[part] > 10);
        CHECK(linear[part] / fine[part] > 50);
    }
    // A steady rotation is met at any distance, up to half a turn.
    PoseRing ring(0);
    for (const double t : {0.0, 1.0})
        REQUIRE(ring.push(t, {{}, axis_angle({1, 2, 2}, 2.5 * t)}, PoseRates{{}, Vec3{1, 2, 2} * (2.5 / 3)}));
    Pose pose;
    REQUIRE(ring.at(0.3, pose));
    const Quat d = conjugate(pose.orientation) * axis_angle({1, 2, 2}, 0.75);
    CHECK(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z) < 1e-12);
}

TEST_CASE("the rotation rate is about the thing's own axes") {
    PoseRing ring(10);
    const Quat start = axis_angle({1, 0, 0}, 1.5707963267948966);
    REQUIRE(ring.push(0, {{}, start}, PoseRates{{}, {0, 0, 0.1}}));
    Pose pose;
    REQUIRE(ring.at(2, pose));
    // Its z axis, -y of the inertial frame, stays where it is.
    const Vec3 z = rotate(pose.orientation, {0, 0, 1}), x = rotate(pose.orientation, {1, 0, 0});
    CHECK_THAT(z.y, WithinAbs(-1, 1e-12));
    CHECK_THAT(x.x, WithinAbs(std::cos(0.2), 1e-12));
    CHECK_THAT(x.z, WithinAbs(std::sin(0.2), 1e-12));
}

TEST_CASE("the ring keeps the last 64 poses, and readers never see a mixture") {
    PoseRing ring(0);
    for (int i = 0; i < 100; ++i)
        REQUIRE(ring.push(i, turned(i, 0)));
    Pose pose;
    REQUIRE(ring.at(0, pose));
    CHECK(pose.position_m.x == 36);
    REQUIRE(ring.at(50.5, pose));
    CHECK(pose.position_m.x == 50.5);

    // All of a pose's numbers tell the same time.
    std::atomic<bool> enough{false};
    std::thread writer([&] {
        for (int i = 100; !enough; ++i)
            ring.push(i, {{i * 1.0, i * 2.0, i * 3.0}, {1, 0, 0, 0}});
    });
    std::uint64_t mixed = 0;
    for (int look = 0; look < 50'000; ++look) {
        Pose seen;
        REQUIRE(ring.at(1e9, seen));
        const Vec3 p = seen.position_m;
        if (p.x >= 100 && (p.y != 2 * p.x || p.z != 3 * p.x)) ++mixed;
    }
    enough = true;
    writer.join();
    CHECK(mixed == 0);
}

TEST_CASE("values of a pose are checked wherever they come from") {
    PoseLine pose{"lander", Time{}, {{1, 2, 3}, {1.0005, 0, 0, 0}}};
    CHECK(check_pose(pose).empty());
    CHECK(pose.pose.orientation == Quat{1, 0, 0, 0});
    pose.rates = PoseRates{{2e9, 0, 0}, {}};
    CHECK_THAT(check_pose(pose), ContainsSubstring("velocity"));
    pose.pose.position_m.y = std::numeric_limits<double>::quiet_NaN();
    CHECK_THAT(check_pose(pose), ContainsSubstring("position"));
}

TEST_CASE("steps and poses of callers that are no clients of the port") {
    CameraBench bench;
    sync::SoftwareTrigger source(bench.clock, "lockstep");
    source.start(bench.camera);
    scene::Scene scene;
    SimulatorServer server("127.0.0.1:0", attach_pose_rings(scene, 0), bench.camera, bench.clock);
    std::atomic<bool> cancelled{false};
    Time last{-1};
    const auto step = [&](std::int64_t ns) { return server.step(Time{ns}, last, cancelled); };
    CHECK_THAT(step(1000).refusal, ContainsSubstring("trigger.source"));
    server.step_with(&source);
    CHECK_THAT(step(1000).refusal, ContainsSubstring("does not acquire"));
    REQUIRE(bench.camera.acquisition_start());
    for (std::uint64_t id = 1; id <= 3; ++id) {
        const SimulatorServer::StepResult made = step(static_cast<std::int64_t>(1000 * id));
        CHECK(made.refusal.empty());
        CHECK(made.frame.frame_id == id);
        CHECK((made.frame.outcome == FrameOutcome::complete || made.frame.outcome == FrameOutcome::late));
    }
    CHECK_THAT(step(3000).refusal, ContainsSubstring("not later"));
    CHECK(last == Time{3000});

    render_gate().close();
    std::string given_up;
    std::thread other([&] { given_up = step(4000).refusal; });
    render_gate().wait_for_render();
    Time own{-1};
    CHECK_THAT(server.step(Time{1}, own, cancelled).refusal, ContainsSubstring("another client's"));
    CHECK(own == Time{-1});
    cancelled = true;
    other.join();
    CHECK_FALSE(given_up.empty());
    render_gate().open();
    bench.wait_ended(4);

    CHECK(server.pose({"camera", Time{1}, {}}).empty());
    CHECK_THAT(server.pose({"camera", Time{1}, {}}), ContainsSubstring("not later"));
    CHECK_THAT(server.pose({"camrea", Time{1}, {}}),
               ContainsSubstring("allowed camera") && ContainsSubstring("did you mean \"camera\"?"));
    CHECK(server.counters().steps == 3);
    CHECK(server.counters().poses == 1);
    CHECK(server.counters().refused == 7);
    server.step_with(nullptr);
    source.stop();
}

} // namespace simulator_test
