// SPDX-License-Identifier: Apache-2.0
// Trajectory and attitude files of scenes: CCSDS messages and tables, their dates, ends and mistakes.
#include "renderer/world/motion.hpp"
#include "renderer/world/pose_age.hpp"
#include "scene_texts.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/daf_writer.hpp"

#include <string>

namespace path_files_test {

using namespace obscura;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

constexpr const char* oem = "CCSDS_OEM_VERS = 2.0\nCREATION_DATE = 2007-01-01\nORIGINATOR = T\nMETA_START\n"
                            "OBJECT_NAME = P\nCENTER_NAME = EARTH\nREF_FRAME = EME2000\nTIME_SYSTEM = UTC\n"
                            "START_TIME = 2007-02-28T12:00:00\nSTOP_TIME = 2007-02-28T12:01:40\nMETA_STOP\n"
                            "2007-02-28T12:00:00 1 2 3 0.01 0 0\n2007-02-28T12:01:40 2 2 3 0.01 0 0\n";
constexpr const char* aem =
    "CCSDS_AEM_VERS = 2.0\nCREATION_DATE = 2007-01-01\nORIGINATOR = T\nMETA_START\n"
    "OBJECT_NAME = P\nREF_FRAME_A = ICRF\nREF_FRAME_B = SC_BODY_1\nTIME_SYSTEM = TAI\n"
    "START_TIME = 2007-02-28T12:00:33\nSTOP_TIME = 2007-02-28T12:01:13\n"
    "ATTITUDE_TYPE = QUATERNION\nMETA_STOP\nDATA_START\n"
    "2007-02-28T12:00:33 0 0 0 1\n"
    "2007-02-28T12:01:13 0 0 0.479425538604203 0.877582561890373\nDATA_STOP\n";
constexpr const char* epoch = "epoch = \"2007-02-28T12:00:10Z\"\n";

struct Files : test::SceneTexts {
    Files() {
        (void)write("p.oem", oem);
        (void)write("p.aem", aem);
        (void)write("p.csv", "time_s,x_m,y_m,z_m\n0,0,0,0\n10,100,0,0\n");
        (void)write("q.csv", "time_s,qw,qx,qy,qz\n0,1,0,0,0\n10,0.877582561890373,0,0,0.479425538604203\n");
        (void)write("all.csv", "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,1,0,0,0\n"
                               "10,100,0,0,0.877582561890373,0,0,0.479425538604203\n");
    }
};

void check_pose(const scene::Motion& motion, double time_s, double x_m, double about_z_rad) {
    INFO(time_s);
    const Pose pose = renderer::pose_at(motion, time_s);
    CHECK_THAT(pose.position_m.x, WithinAbs(x_m, 1e-6));
    CHECK_THAT(2 * std::atan2(pose.orientation.z, pose.orientation.w), WithinAbs(about_z_rad, 1e-9));
}

} // namespace

TEST_CASE("trajectory and attitude messages place the camera in scene time") {
    const Files files;
    const scene::Scene scene =
        files.scene(std::string(epoch) + "[camera]\ntrajectory = \"p.oem\"\nattitude = \"p.aem\"\n"
                                         "max_extrapolation_s = 5\n");
    const scene::Motion& motion = scene.camera.motion;
    check_pose(motion, 0, 1100, 0.25); // 10 s after the first sample of each
    check_pose(motion, 30, 1400, 1);
    check_pose(motion, 35, 1450, 1.125); // goes on with the rate between the last two, 0.025 rad/s
    check_pose(motion, 60, 1700, 1.125);
    check_pose(motion, 200, 2050, 1.125); // velocity of 10 m/s for 5 s, then held
    check_pose(motion, -12, 980, -0.05);
    CHECK(motion.path->times_s() == std::vector<double>{-10, 30, 90});
    CHECK_THAT(renderer::camera_pose_age_s(scene, {}, 20), WithinAbs(0, 1e-12));
    CHECK_THAT(renderer::camera_pose_age_s(scene, {}, 33), WithinAbs(3, 1e-9)); // of the attitude
    CHECK_THAT(renderer::camera_pose_age_s(scene, {}, -11), WithinAbs(1, 1e-9));
    // What lists the instants of a motion finds them.
    REQUIRE(motion.samples.size() == 3);
    CHECK(motion.samples[1].time_s == 30);
    CHECK_THAT(motion.samples[1].pose.position_m.x, WithinAbs(1400, 1e-6));
}

TEST_CASE("messages and tables go together, and one of them may be constant") {
    const Files files;
    const auto motion = [&](const std::string& keys) {
        return files.scene(epoch + ("[camera]\n" + keys)).camera.motion;
    };
    check_pose(motion("trajectory = \"p.csv\"\nattitude = \"p.aem\"\n"), 5, 50, 0.375);
    check_pose(motion("trajectory = \"p.oem\"\nattitude = \"q.csv\"\n"), 5, 1150, 0.5);
    check_pose(motion("trajectory = \"p.oem\"\norientation = [0, 0, 0, 1]\n"), 5, 1150, 3.14159265358979);
    check_pose(motion("position_m = [7, 0, 0]\nattitude = \"q.csv\"\n"), 5, 7, 0.5);
    check_pose(motion("trajectory = \"all.csv\"\nmax_extrapolation_s = 2\n"), 11, 110, 1.1);
    check_pose(motion("trajectory = \"all.csv\"\nmax_extrapolation_s = 2\n"), 99, 120, 1.2);
    check_pose(motion("trajectory = \"all.csv\"\n"), 11, 100, 1);
    const scene::Motion aimed = motion("trajectory = \"p.oem\"\nlook_at_m = [0, 0, 0]\n");
    CHECK(aimed.aim.has_value());
    CHECK(aimed.path != nullptr);
    const scene::Scene held = files.scene("[camera]\ntrajectory = \"all.csv\"\n");
    CHECK(renderer::camera_pose_age_s(held, {}, 10) == 0);
    CHECK(renderer::camera_pose_age_s(held, {}, 12) == 2);
    CHECK(renderer::camera_pose_age_s(held, {}, -3) == 3);
    REQUIRE(renderer::aged_poses(held, 12).size() == 1);
    CHECK(
        renderer::aged_poses(held, 12)[0].text() ==
        "the poses of the camera are known for other times (0 s to 10 s): at scene time 12 s they are 2 s away, "
        "and it is held or extrapolated");
    CHECK(renderer::aged_poses(held, 5).empty());
    const scene::Scene both =
        files.scene(std::string(epoch) + "[camera]\ntrajectory = \"p.oem\"\nattitude = \"p.aem\"\n");
    REQUIRE(renderer::aged_poses(both, 33).size() == 1);
    CHECK(renderer::aged_poses(both, 33)[0].key == "attitudes of the camera");
    CHECK(renderer::camera_pose_age_s(files.scene("[camera]\nposition_m = [1, 2, 3]\n"), {}, 1e6) == 0);
}

TEST_CASE("a body on a parent takes frames of any name") {
    const Files files;
    std::string rotating = oem;
    rotating.replace(rotating.find("EME2000"), 7, "ITRF");
    (void)files.write("r.oem", rotating);
    const std::string body =
        "[[body]]\nname = \"a\"\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.5\n";
    const scene::Scene scene = files.scene(epoch + body + body.substr(0, 16) + "\"b\"" + body.substr(19) +
                                           "parent = \"a\"\ntrajectory = \"r.oem\"\n");
    CHECK_THAT(renderer::pose_at(scene.bodies[1].motion, 0).position_m.x, WithinAbs(1100, 1e-6));
    CHECK(files.refusal(epoch + body + "trajectory = \"r.oem\"\n") ==
          "r.oem: reference frame ITRF, allowed without a parent are ICRF, GCRF, EME2000 and J2000");
}

TEST_CASE("a message counts from the body that it names, where the kernels have it") {
    const Files files;
    // The Earth moves by 30 km/s along y, Mars stands; states of 3 axes by one record of Chebyshev series.
    const double begin = 225936065.0, radius = 1e4; // about the epoch, TDB
    const auto moving = [&](std::int32_t id, double x_km, double rate_km_s) {
        return test::DafSegment{
            "T",
            {begin - radius, begin + radius},
            {id, 0, 1, 2},
            {begin, radius, x_km, 0, 0, rate_km_s * radius, 0, 0, begin - radius, 2 * radius, 8, 1}};
    };
    (void)files.write(
        "k.bsp",
        test::daf_bytes("SPK", {moving(399, 1000, 30), moving(499, 5e6, 0), moving(10, 1e8, 0)}, false));
    const std::string kernels = epoch + std::string("kernels = [\"k.bsp\"]\n");
    const auto at = [&](const std::string& root, const std::string& keys, double t) {
        const scene::Scene scene = files.scene(root + "[camera]\nboresight = [0, 0, 1]\n" + keys);
        return renderer::pose_at(scene.camera.motion, t).position_m;
    };
    const std::string oem_key = "trajectory = \"p.oem\"\n";
    // From the barycentre: the Earth's place and its way, and the 1.1 km of the message at scene time 0.
    const Vec3 first = at(kernels, oem_key, 0), later = at(kernels, oem_key, 20);
    CHECK_THAT(first.x, WithinAbs(1000e3 + 1100, 1e-3));
    CHECK_THAT(later.y - first.y, WithinAbs(20 * 30e3, 1e-3));
    CHECK_THAT(later.x - first.x, WithinAbs(200, 1e-3));
    // The frame at the Earth's place at the epoch does not move with it.
    const std::string centred = kernels + "centre = \"EARTH\"\n";
    CHECK_THAT(at(centred, oem_key, 0).y, WithinAbs(2000, 1e-3));
    CHECK_THAT(at(centred, oem_key, 20).y, WithinAbs(2000 + 20 * 30e3, 1e-3));
    // As with the key "ephemeris" of that body; of another one it is refused, as is another parent.
    CHECK(length(at(kernels, oem_key + "ephemeris = \"EARTH\"\n", 20) - later) < 1e-6);
    const std::string camera = "[camera]\nboresight = [0, 0, 1]\n" + oem_key;
    CHECK_THAT(files.refusal(kernels + camera + "ephemeris = \"MARS\"\n"),
               ContainsSubstring("trajectory: is about EARTH, which is not the ephemeris MARS"));
    const std::string mars = "[[body]]\nname = \"mars\"\nephemeris = \"MARS\"\nephemeris_frame = \"J2000\"\n"
                             "shape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.5\n";
    CHECK_THAT(files.refusal(kernels + camera + "relative_to = \"mars\"\n" + mars),
               ContainsSubstring("trajectory: is about EARTH, which is not the parent mars"));
    // Inertial states do not turn with a parent.
    CHECK_THAT(files.refusal(kernels + camera + "parent = \"mars\"\n" + mars),
               ContainsSubstring("with inertial axes \"relative_to\" is wanted in place of \"parent\""));
    // A frame that no kernel knows.
    std::string rotating = oem;
    rotating.replace(rotating.find("EME2000"), 7, "ITRF");
    (void)files.write("r.oem", rotating);
    CHECK_THAT(files.refusal(kernels + "[camera]\nboresight = [0, 0, 1]\ntrajectory = \"r.oem\"\n"),
               ContainsSubstring("trajectory: frame ITRF: unknown"));
}

TEST_CASE("mistakes about trajectory and attitude files are reported") {
    const Files files;
    (void)files.write("broken.aem", std::string(aem).replace(std::string(aem).find("0 0 0 1"), 7, "0 0 0 2"));
    (void)files.write("not_unit.csv", "time_s,qw,qx,qy,qz\n0,1,0,0,0\n10,1,0,0,1\n");
    (void)files.write("back.csv", "time_s,qw,qx,qy,qz\n0,1,0,0,0\n0,1,0,0,0\n");
    struct Case {
        std::string keys;
        const char* message;
    };
    for (const Case& c : {
             Case{"trajectory = \"p.oem\"\nattitude = \"broken.aem\"\n",
                  "broken.aem:14: |q| = 2, a unit quaternion is wanted"},
             Case{"attitude = \"not_unit.csv\"\n",
                  "not_unit.csv:3:4: qw: |q| = 1.41421, a unit quaternion is wanted"},
             Case{"attitude = \"back.csv\"\n", "back.csv:3:1: time_s: 0 does not come after 0"},
             Case{"trajectory = \"p.aem\"\nboresight = [1, 0, 0]\n",
                  "p.aem: is an attitude message (AEM), which belongs to the key \"attitude\""},
             Case{"attitude = \"p.oem\"\n",
                  "p.oem: is no attitude message (AEM) and no table, allowed is time_s,qw,qx,qy,qz"},
             Case{"trajectory = \"p.oem\"\n", "s.toml:3:14: camera.trajectory: has no columns qw,qx,qy,qz: "
                                              "\"look_at\", \"look_at_m\", \"boresight\", "
                                              "\"orientation\" or \"attitude\" is wanted beside it"},
             Case{"max_extrapolation_s = 3\n",
                  "s.toml:3:23: camera.max_extrapolation_s: belongs to \"trajectory\" or \"attitude\""},
             Case{"trajectory = \"all.csv\"\nattitude = \"q.csv\"\n",
                  "s.toml:4:12: camera.attitude: cannot stand beside a \"trajectory\" with columns "
                  "qw,qx,qy,qz"},
         }) {
        INFO(c.keys);
        CHECK(files.refusal(epoch + ("[camera]\n" + c.keys)) == c.message);
    }
    CHECK(files.refusal("[camera]\ntrajectory = \"p.oem\"\nboresight = [1, 0, 0]\n") ==
          "p.oem: has dates: the scene needs the key \"epoch\"");
    // One mistake, not two.
    const std::string soon =
        files.refusal("epoch = \"soon\"\n[camera]\ntrajectory = \"p.oem\"\nboresight = [1, 0, 0]\n");
    CHECK(soon.starts_with("s.toml:1:9: epoch: time \"soon\": character 1: \"SOON\" begins no time"));
    CHECK(soon.find('\n') == std::string::npos);
}

} // namespace path_files_test
