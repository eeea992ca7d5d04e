// SPDX-License-Identifier: Apache-2.0
// Scenes with SPICE kernels: places, rotations and radii of bodies, cameras that follow bodies, mistakes.
#include "config/document.hpp"
#include "core/error.hpp"
#include "ephemeris/kernels/apparent_place.hpp"
#include "ephemeris/time/time_text.hpp"
#include "renderer/scene/kernel_frame.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/world/pose_age.hpp"
#include "renderer/world/scene_poses.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/daf_writer.hpp"
#include "tests/support/data.hpp"
#include "tests/support/de405_states.hpp"
#include "tests/support/temp_folder.hpp"

#include <array>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <limits>
#include <numbers>
#include <string>

namespace kernel_scene_test {

using namespace obscura;
using Catch::Matchers::ContainsSubstring;
using obscura::test::angle;

namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr double mas = deg / 3.6e6;

double angle_between(Quat a, Quat b) {
    const Quat d = conjugate(a) * b;
    return 2 * std::atan2(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w));
}

/// SPK segment of uniform motion from `begin` to `end`, km and km/s at time 0.
test::DafSegment uniform(std::int32_t target, std::int32_t center, double begin, double end, Vec3 position,
                         Vec3 velocity) {
    const double middle = (begin + end) / 2, half = (end - begin) / 2;
    const Vec3 p = position + velocity * middle, v = velocity * half;
    return {"UNIFORM",
            {begin, end},
            {target, center, 1, 2},
            {middle, half, p.x, v.x, p.y, v.y, p.z, v.z, begin, end - begin, 8, 1}};
}

constexpr const char* rotations = R"(KPL/PCK
\begindata
BODY502_RADII = ( 1562.6 1560.3 1559.5 )
BODY502_POLE_RA = ( 268.08 ) BODY502_POLE_DEC = ( 64.51 ) BODY502_PM = ( 36.022 101.3747235 )
\begintext
)";

/// Folder with kernels of Sun, Jupiter, Europa and a spacecraft, and scenes that use them.
class KernelScene {
public:
    KernelScene() {
        folder_.write("rotations.tpc", rotations);
        folder_.write("all.tm", "KPL/MK\n\\begindata\nKERNELS_TO_LOAD = ( 'rotations.tpc' 'moons.bsp' )\n");
        folder_.write("moons.bsp",
                      test::daf_bytes("SPK",
                                      {uniform(10, 0, -1e5, 1e5, {-7e5, 5e5, 2e5}, {0.01, 0.005, 0}),
                                       uniform(599, 0, -1e5, 1e5, {-3e8, -6.8e8, -2.8e8}, {11.9, -4, -2}),
                                       uniform(502, 599, -1e5, 1e5, {6e5, 3e5, 1e5}, {-6, 12, 5}),
                                       uniform(-900, 502, -100, 200, {0, 20000, 0}, {1, 0, 0}),
                                       uniform(-900, 502, 400, 500, {0, 20000, 0}, {1, 0, 0})},
                                      false));
    }
    [[nodiscard]] scene::Scene load(const std::string& tables) const {
        return scene::load_scene(folder_.write("s.toml", head + tables));
    }
    [[nodiscard]] ephemeris::Ephemeris kernels() const {
        return ephemeris::Ephemeris({folder_.path() / "all.tm"});
    }
    [[nodiscard]] const std::filesystem::path& path() const { return folder_.path(); }
    void write(const std::string& name, const std::string& text) const { (void)folder_.write(name, text); }
    [[nodiscard]] std::string refusal(const std::string& text) const {
        const auto file = folder_.write("s.toml", text);
        try {
            (void)scene::load_scene(file);
        } catch (const Error& error) {
            const std::string all = error.what();
            return all.substr(all.find("s.toml"));
        }
        return "accepted";
    }

    const std::string head = "epoch = \"2000-01-01T12:00:00 TDB\"\n"
                             "kernels = \"all.tm\"\ncentre = \"JUPITER\"\n";

private:
    test::TempFolder folder_;
};

/// Writes the clock of a spacecraft and the frame CRAFT: 100 ticks a second, at 100000 at the epoch.
void write_clock(const KernelScene& files) {
    files.write("clock.tsc",
                "KPL/SCLK\n\\begindata\nSCLK_DATA_TYPE_77 = ( 1 )\nSCLK01_TIME_SYSTEM_77 = ( 1 )\n"
                "SCLK01_N_FIELDS_77 = ( 2 )\nSCLK01_MODULI_77 = ( 1000000 100 )\n"
                "SCLK01_OFFSETS_77 = ( 0 0 )\nSCLK01_COEFFICIENTS_77 = ( 0 -1000. 1.D0 )\n"
                "FRAME_CRAFT = -77001\nFRAME_-77001_NAME = 'CRAFT'\nFRAME_-77001_CLASS = 3\n"
                "FRAME_-77001_CLASS_ID = -77001\nFRAME_-77001_CENTER = -77\n"
                "CK_-77001_SCLK = -77\n\\begintext\n");
}
/// A scene whose camera has the attitudes of a CK.
scene::Scene scene_of_ck(const KernelScene& files, const std::string& camera,
                         const test::DafSegment& segment) {
    files.write("a.bc", test::daf_bytes("CK", {segment}, false));
    std::string text = files.head + camera;
    text.replace(text.find("\"all.tm\""), 8, "[\"all.tm\", \"clock.tsc\", \"a.bc\"]");
    files.write("ck.toml", text);
    return scene::load_scene(files.path() / "ck.toml");
}

} // namespace

TEST_CASE("A body of the kernels has their place, rotation, radii and name") {
    const KernelScene files;
    const scene::Scene s = files.load("[[body]]\nalbedo = 0.6\nephemeris = \"EUROPA\"\n");
    REQUIRE(s.bodies.size() == 1);
    CHECK(s.bodies[0].name == "EUROPA");
    REQUIRE(s.bodies[0].shape.kind() == "ellipsoid");
    const Vec3 radii = s.bodies[0].shape.get<renderer::EllipsoidParameters>().radii_m;
    CHECK(length(radii - Vec3{1562.6, 1560.3, 1559.5} * 1000.0) < 1e-6);
    const ephemeris::Ephemeris kernels = files.kernels();
    const renderer::ScenePoses poses(s);
    for (const double t : {0.0, 1000.0, -30000.0}) {
        const Pose pose = poses.body(0, t).pose;
        // Jupiter's own motion is seen, as the frame is at rest relative to the barycentre.
        const ephemeris::Epoch now{ephemeris::to_epoch({0, 0}).tai_ns + std::llround(t * 1e9)};
        const ephemeris::TdbTime tdb = ephemeris::to_tdb(now);
        const Vec3 expected = (Vec3{6e5, 3e5, 1e5} + Vec3{-6 + 11.9, 12 - 4, 5 - 2} * tdb.seconds()) * 1000.0;
        // 5 mm are half a microsecond of time.
        CHECK(length(pose.position_m - expected) < 5e-3);
        const Quat turned = kernels.orientation("IAU_EUROPA", tdb);
        CHECK(angle_between(pose.orientation, turned) < 1e-10);
    }
    // The Sun is where the kernels have it, and moves with them.
    const Vec3 sun = Vec3{-7e5 + 3e8, 5e5 + 6.8e8, 2e5 + 2.8e8} * 1000.0;
    CHECK(length(s.sun.position_m - sun) < 1e-3);
    CHECK(length(s.sun.position_at(30000) - (sun + Vec3{0.01, 0.005, 0} * 30e6)) < 1e-2);
    CHECK(length(poses.sun(30000).pose.position_m - (sun + Vec3{0.01, 0.005, 0} * 30e6)) < 1e-2);
    const scene::Scene placed = files.load("[sun]\nposition_m = [1e11, 0, 0]\n");
    CHECK(placed.sun.position_at(30000) == Vec3{1e11, 0, 0});
}

TEST_CASE("Kernels are a list of files, or the default ephemeris where none is named") {
    const KernelScene files;
    const std::string epoch = "epoch = \"2000-01-01T12:00:00 TDB\"\n";
    const std::string centre = "centre = \"JUPITER\"\n";
    const std::string body = "[[body]]\nalbedo = 0.6\nephemeris = \"EUROPA\"\n";
    const auto place = [](const scene::Scene& s) { return renderer::ScenePoses(s).body(0, 1000).pose; };
    const Pose expected = place(files.load(body));
    files.write("list.toml", epoch + "kernels = [\"rotations.tpc\", \"moons.bsp\"]\n" + centre + body);
    const Pose listed = place(scene::load_scene(files.path() / "list.toml"));
    CHECK(length(listed.position_m - expected.position_m) == 0);
    CHECK_THAT(files.refusal(epoch + "kernels = [\"rotations.tpc\", \"none.bsp\"]\n"),
               ContainsSubstring("kernels: ") && ContainsSubstring("none.bsp: no such file"));
    CHECK_THAT(files.refusal(epoch + "kernels = [3]\n"), ContainsSubstring("kernels: "));
    CHECK_THAT(files.refusal(epoch + "kernels = 3\n"),
               ContainsSubstring("a file name, or an array of file names"));

    // The first place that has the file.
    const test::TempFolder user, machine;
    setenv("XDG_DATA_HOME", user.path().c_str(), 1);
    setenv("XDG_DATA_DIRS", machine.path().c_str(), 1);
    const std::string plain = "[[body]]\nalbedo = 0.6\nephemeris = \"EUROPA\"\nephemeris_frame = \"J2000\"\n"
                              "radii_m = [1e6, 1e6, 1e6]\n";
    CHECK_THAT(
        files.refusal(epoch + plain),
        ContainsSubstring("s.toml:4:13: body[0].ephemeris: the scene has no \"kernels\", and there is no "
                          "default ephemeris ") &&
            ContainsSubstring("de405.bsp: `obscura import ephemeris` makes it"));
    for (const auto& folder : {machine.path(), user.path()}) {
        CAPTURE(folder.string());
        std::filesystem::create_directories(folder / "obscura");
        std::filesystem::copy_file(files.path() / "moons.bsp", folder / "obscura/de405.bsp");
        files.write("default.toml", epoch + centre + plain);
        const scene::Scene s = scene::load_scene(files.path() / "default.toml");
        CHECK(length(place(s).position_m - expected.position_m) == 0);
        CHECK(s.sun.path != nullptr);
        CHECK(files.refusal(plain).find("kernels: \"ephemeris\" needs the key \"epoch\"") !=
              std::string::npos);
        std::filesystem::remove(folder / "obscura/de405.bsp");
    }
    unsetenv("XDG_DATA_HOME");
    unsetenv("XDG_DATA_DIRS");
}

TEST_CASE("One of several cameras follows the scene's kernels") {
    const KernelScene files;
    scene::Scene s = files.load("[[body]]\nalbedo = 0.6\nephemeris = \"EUROPA\"\n");
    const auto view = [](const std::string& text) { return config::parse_text(text, "view.toml"); };
    (void)scene::read_view(view("ephemeris = \"-900\"\nlook_at = \"EUROPA\"\n"), {"view.toml", "camera.view"},
                           s);
    const Vec3 moon = renderer::ScenePoses(s).body(0, 100).pose.position_m;
    CHECK(length(renderer::ScenePoses(s).camera(100).position_m - (moon + Vec3{100e3, 20e6, 0})) < 1e-2);
    scene::Scene without;
    CHECK_THROWS_WITH(scene::read_view(view("ephemeris = \"-900\"\n"), {"view.toml", "camera.view"}, without),
                      ContainsSubstring("camera.view.ephemeris: the scene has no \"kernels\""));
}

TEST_CASE("Cameras follow bodies of the kernels, at a constant pose in a frame of theirs") {
    const KernelScene files;
    const std::string europa =
        "[[body]]\nalbedo = 0.6\nname = \"moon\"\nephemeris = \"EUROPA\"\nradii_m = [1e6, 1e6, 1e6]\n";
    const auto camera_at = [&](const std::string& keys, double t) {
        return renderer::ScenePoses(files.load("aberration = true\n[camera]\n" + keys + europa)).camera(t);
    };
    const Vec3 moon0 = Vec3{6e5, 3e5, 1e5} * 1000.0;
    const Vec3 v = Vec3{-6 + 11.9, 12 - 4, 5 - 2} * 1000.0;
    // The spacecraft of the kernels, aimed at the body.
    const Pose craft = camera_at("ephemeris = \"-900\"\nlook_at = \"moon\"\n", 100);
    CHECK(length(craft.position_m - (moon0 + v * 100 + Vec3{100e3, 20e6, 0})) < 1e-2);
    CHECK(angle(rotate(craft.orientation, {0, 0, 1}), {-100e3, -20e6, 0}) < 1e-3);
    // Beside a body, with axes that do not turn with it.
    const Pose beside = camera_at("ephemeris = \"EUROPA\"\nposition_m = [0, 0, 5e6]\n"
                                  "boresight = [0, 0, -1]\nup = [0, 1, 0]\n",
                                  5000);
    // TDB has run 2 us ahead.
    CHECK(length(beside.position_m - (moon0 + v * 5000 + Vec3{0, 0, 5e6})) < 3e-2);
    CHECK(length(rotate(beside.orientation, {0, 0, 1}) - Vec3{0, 0, -1}) < 1e-12);
    // The same by the body of the scene.
    const Pose by_scene = camera_at("relative_to = \"moon\"\nposition_m = [0, 0, 5e6]\n"
                                    "boresight = [0, 0, -1]\nup = [0, 1, 0]\n",
                                    5000);
    CHECK(length(by_scene.position_m - beside.position_m) < 1e-3);
    CHECK(length(rotate(by_scene.orientation, {0, 0, 1}) - Vec3{0, 0, -1}) < 1e-12);
    // In the axes of a frame of the kernels it is where a child of the body is.
    const std::string place = "position_m = [0, 0, 5e6]\nboresight = [0, 1, -1]\nup = [0, 1, 1]\n";
    const Pose landed = camera_at("ephemeris = \"EUROPA\"\nephemeris_frame = \"IAU_EUROPA\"\n" + place, 5000);
    const Pose child = camera_at("parent = \"moon\"\n" + place, 5000);
    CHECK(length(landed.position_m - child.position_m) < 1e-2);
    CHECK(angle_between(landed.orientation, child.orientation) < 1e-12);
    CHECK(length(landed.position_m - beside.position_m) > 1e6);
    // A trajectory about the body, with axes that do not turn with it.
    files.write("orbit.csv", "time_s,x_m,y_m,z_m\n0,5e6,0,0\n100,5e6,1e6,0\n200,5e6,2e6,1e6\n");
    const Pose orbit =
        camera_at("ephemeris = \"EUROPA\"\ntrajectory = \"orbit.csv\"\nlook_at = \"moon\"\n", 150);
    CHECK(length(orbit.position_m - (moon0 + v * 150 + Vec3{5e6, 1.5e6, 0.5e6})) < 1e-2);
    CHECK(angle(rotate(orbit.orientation, {0, 0, 1}), {-5e6, -1.5e6, -0.5e6}) < 1e-3);
    const Pose orbit_by_scene =
        camera_at("relative_to = \"moon\"\ntrajectory = \"orbit.csv\"\nlook_at = \"moon\"\n", 150);
    CHECK(length(orbit_by_scene.position_m - orbit.position_m) < 1e-3);
    CHECK(angle_between(orbit_by_scene.orientation, orbit.orientation) < 1e-9);
    // The velocity for aberration is that of the motion as a whole.
    const renderer::ScenePoses poses(
        files.load("aberration = true\n[camera]\nephemeris = \"-900\"\n" + europa));
    CHECK(length(poses.camera_velocity_m_s(50) - (v + Vec3{1000, 0, 0})) < 0.05);
}

TEST_CASE("An attitude that is known for an instant does not stop the position") {
    const KernelScene files;
    write_clock(files);
    const std::string camera =
        "aberration = true\n[camera]\nephemeris = \"-900\"\nephemeris_frame = \"CRAFT\"\n";
    const Vec3 v = Vec3{11.9 - 6 + 1, -4 + 12, -2 + 5} * 1000.0; // of the SPK
    const double half = std::sqrt(0.5);
    for (const double ticks : {0.1, 1.0, 20.0, 10000.0}) {
        INFO(ticks);
        const std::vector<double> words{half,  0,       0,           -half,   half, 0, 0,
                                        -half, 99999.9, 1e5 + ticks, 99999.9, 1,    2};
        const scene::Scene s =
            scene_of_ck(files, camera, {"ATTITUDE", {99999.9, 1e5 + ticks}, {-77001, 1, 3, 0}, words});
        const renderer::ScenePoses poses(s);
        const scene::PosePath& path = *s.camera.motion.path;
        for (const double t : {0.0, 0.004, 50.0, 150.0}) {
            INFO(t);
            CHECK(length(poses.camera_velocity_m_s(t) - v) < 1e-3);
            CHECK(length(path.at(t).position_m - path.at(0).position_m - v * t) < 1e-3 + 1e-7 * t);
            CHECK(angle(rotate(path.at(t).orientation, {1, 0, 0}), {0, 1, 0}) < 1e-12);
        }
        // The age is that of the attitude.
        CHECK(std::abs(path.age_s(150) - (150 - ticks / 100)) < 1e-3);
        // Where the position holds it has no velocity.
        CHECK(length(poses.camera_velocity_m_s(300)) == 0);
    }
}

TEST_CASE("An attitude of exactly one instant is held, before and after it") {
    const KernelScene files;
    write_clock(files);
    const double half = std::sqrt(0.5);
    for (const double at_s : {0.0, 30.0, -20.0}) {
        INFO(at_s);
        const double ticks = 1e5 + 100 * at_s;
        const scene::Scene s = scene_of_ck(
            files, "[camera]\nephemeris = \"-900\"\nephemeris_frame = \"CRAFT\"\n",
            {"ATTITUDE", {ticks, ticks}, {-77001, 1, 3, 0}, {half, 0, 0, -half, ticks, ticks, 1, 1}});
        const scene::PosePath& path = *s.camera.motion.path;
        for (const double t : {-50.0, 0.0, at_s, 150.0}) {
            CHECK(angle(rotate(path.at(t).orientation, {1, 0, 0}), {0, 1, 0}) < 1e-12);
            CHECK(std::abs(path.ages(t).attitude_s - std::abs(t - at_s)) < 1e-5);
        }
        const std::vector<std::string> said = renderer::instant_attitudes(s);
        REQUIRE(said.size() == 1);
        CHECK_THAT(said[0], ContainsSubstring("the attitude of the camera is known at one instant only"));
        REQUIRE(path.attitude_instants_s().size() == 1);
        CHECK(std::abs(path.attitude_instants_s()[0] - at_s) < 1e-5);
    }
    // An interval that does not cover scene time 0 is refused as before.
    CHECK_THROWS_WITH(scene_of_ck(files, "[camera]\nephemeris = \"-900\"\nephemeris_frame = \"CRAFT\"\n",
                                  {"ATTITUDE",
                                   {1.1e5, 1.2e5},
                                   {-77001, 1, 3, 0},
                                   {half, 0, 0, -half, half, 0, 0, -half, 1.1e5, 1.2e5, 1.1e5, 1, 2}}),
                      ContainsSubstring("not covered by the loaded kernels"));
    // A message of one attitude is held too.
    files.write("one.aem", "CCSDS_AEM_VERS = 1.0\nCREATION_DATE = 2020-01-01T00:00:00\nORIGINATOR = T\n"
                           "META_START\nOBJECT_NAME = A\nOBJECT_ID = A\nREF_FRAME_A = ICRF\n"
                           "REF_FRAME_B = SC_BODY_1\nATTITUDE_DIR = A2B\nTIME_SYSTEM = TDB\n"
                           "START_TIME = 2000-01-01T12:00:00\nSTOP_TIME = 2000-01-01T12:00:00\n"
                           "ATTITUDE_TYPE = QUATERNION\nQUATERNION_TYPE = FIRST\nMETA_STOP\nDATA_START\n"
                           "2000-01-01T12:00:00 1 0 0 0\nDATA_STOP\n");
    const scene::Scene aem = files.load("[camera]\nposition_m = [0, 0, 1e9]\nattitude = \"one.aem\"\n");
    CHECK(renderer::instant_attitudes(aem).size() == 1);
}

TEST_CASE("In gaps of kernels the pose at the nearest covered time is used, and its age grows") {
    const KernelScene files;
    const scene::Scene s = files.load("[camera]\nephemeris = \"-900\"\n");
    const auto& path = s.camera.motion.path;
    REQUIRE(path);
    CHECK(path->age_s(150) == 0);
    CHECK(std::abs(path->age_s(250) - 50) < 1e-3);
    CHECK(std::abs(path->age_s(390) - 10) < 1e-3);
    CHECK(std::abs(path->age_s(-400) - 300) < 1e-3);
    CHECK(std::abs(path->age_s(1500) - 1000) < 1e-3);
    CHECK(length(path->at(250).position_m - path->at(199.99).position_m) < 500);
    CHECK(length(path->at(390).position_m - path->at(400.01).position_m) < 500);
    CHECK(path->times_s().size() == 4);
}

TEST_CASE("Mistakes in the keys of kernels are reported with their place") {
    const KernelScene files;
    const auto said = [&](const std::string& tables) { return files.refusal(files.head + tables); };
    CHECK_THAT(files.refusal("kernels = \"moons.bsp\"\n[[body]]\nalbedo = 0.6\nephemeris = \"EUROPA\"\n"),
               ContainsSubstring("kernels: need the key \"epoch\""));
    CHECK_THAT(files.refusal("kernels = \"none.bsp\"\n"), ContainsSubstring("none.bsp: no such file"));
    CHECK_THAT(files.refusal("centre = \"SUN\"\n"),
               ContainsSubstring("centre: belongs to \"kernels\" or \"ephemeris\""));
    CHECK_THAT(files.refusal("epoch = \"2100-01-01\"\nkernels = \"moons.bsp\"\ncentre = \"JUPITER\"\n"),
               ContainsSubstring("centre: JUPITER (599) relative to") &&
                   ContainsSubstring("is covered 1999-"));
    CHECK_THAT(said("[[body]]\nalbedo = 0.6\nephemeris = \"EUROPE\"\n"),
               ContainsSubstring("body[0].ephemeris: body EUROPE: unknown, did you mean \"EUROPA\"?"));
    CHECK_THAT(said("[[body]]\nalbedo = 0.6\nephemeris = \"JUPITER\"\n"),
               ContainsSubstring("frame IAU_JUPITER: no rotation is loaded"));
    CHECK_THAT(said("[[body]]\nalbedo = 0.6\nephemeris = \"JUPITER\"\nephemeris_frame = \"J2000\"\n"),
               ContainsSubstring("the key \"radii_m\" is missing, and no kernel has radii"));
    CHECK_THAT(said("[[body]]\nalbedo = 0.6\nephemeris = \"EUROPA\"\nparent = \"x\"\n"),
               ContainsSubstring("cannot stand beside \"ephemeris\""));
    CHECK_THAT(said("[[body]]\nalbedo = 0.6\nephemeris = \"EUROPA\"\nrelative_to = \"x\"\n"),
               ContainsSubstring("relative_to: cannot stand beside \"ephemeris\""));
    CHECK_THAT(said("[camera]\nparent = \"x\"\nrelative_to = \"x\"\n"), ContainsSubstring("relative_to"));
    CHECK_THAT(said("[camera]\nrelative_to = \"x\"\n"), ContainsSubstring("'x' is no body of the scene"));
    CHECK_THAT(said("[[body]]\nalbedo = 0.6\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nephemeris_frame = "
                    "\"J2000\"\n"),
               ContainsSubstring("ephemeris_frame: needs \"ephemeris\""));
    CHECK_THAT(said("[camera]\nephemeris = \"-900\"\nephemeris_frame = \"MIST\"\n"),
               ContainsSubstring("camera.ephemeris: frame MIST: unknown"));
    CHECK(said("[[body]]\nalbedo = 0.6\nephemeris = \"EUROPA\"\n") == "accepted");
}

TEST_CASE("The Sun moves as in the kernels, to 0.3 mm") {
    const auto file = test::data_file("ephemeris/de405_2000-2050.bsp");
    if (!file) return;
    const test::TempFolder folder;
    const auto scene_file = folder.write("s.toml", "epoch = \"2026-03-01T12:00:00Z\"\nkernels = \"" +
                                                       file->string() + "\"\ncentre = \"EARTH\"\n");
    const scene::Scene s = scene::load_scene(scene_file);
    double fastest_m_s = 0;
    for (double t = -12 * 86400; t < 12 * 86400; t += 12345.6) {
        CAPTURE(t);
        CHECK(length(s.sun.position_at(t) - s.kernels->position(10, t)) < 3e-4);
        fastest_m_s = std::max(fastest_m_s, length(s.sun.position_at(t + 1) - s.sun.position_at(t)));
    }
    CHECK(fastest_m_s > 10);
    CHECK(fastest_m_s < 17);
}

TEST_CASE("The camera sees planets where python3-skyfield has them, to a milliarcsecond") {
    const auto file = test::data_file("ephemeris/de405_2000-2050.bsp");
    if (!file) return;
    struct Case {
        const char* name;
        int observer;
        ephemeris::TdbTime time;
        Vec3 astrometric, aberrated, apparent;
    };
    // skyfield 1.45: observe(), add_aberration(), and add_deflection() by the Sun before it, as in
    // tests/unit/ephemeris/places_test.cpp.
    constexpr std::array cases{
        Case{"MOON",
             399,
             {765958887, 0.35999999999999999},
             {0.82908151985550305, 0.50049912562952048, 0.249247785703654},
             {0.82913509590348999, 0.50042579199057435, 0.249216812136976},
             {0.82913509590026568, 0.50042579199466131, 0.24921681213949631}},
        Case{"VENUS BARYCENTER",
             399,
             {225936001, 0.25},
             {0.98842153825638823, 0.1439788331670783, 0.047884844269576954},
             {0.98843464040872042, 0.14390040946536148, 0.047850118033134138},
             {0.98843463621111904, 0.14390043487428689, 0.047850128329856412}},
        Case{"EARTH",
             4,
             {900000123, 0.5},
             {-0.14538924236693326, -0.90556503249601716, -0.39851466738936525},
             {-0.1454637719594313, -0.90555595486146179, -0.39850809736099541},
             {-0.14546373843740615, -0.90555595954085755, -0.39850809896393663}},
    };
    const test::TempFolder folder;
    for (const Case& c : cases) {
        CAPTURE(c.name);
        // The scene begins a day before.
        constexpr double later_s = 86400;
        const ephemeris::Epoch epoch = ephemeris::to_epoch(c.time);
        const std::string start =
            ephemeris::write_time({epoch.tai_ns - 86'400'000'000'000}, ephemeris::TimeScale::tai,
                                  ephemeris::TimeForm::iso, ephemeris::erfa_leap_seconds());
        const auto scene_file = folder.write(
            "s.toml", "epoch = \"" + start + "\"\nkernels = \"" + file->string() +
                          "\"\nlight_time = true\n"
                          "aberration = true\n[camera]\nephemeris = \"" +
                          std::to_string(c.observer) +
                          "\"\n"
                          "look_at = \"target\"\nwidth = 101\nheight = 101\nfocal_length_mm = 1000\n"
                          "[[body]]\nalbedo = 0.6\nname = \"target\"\nephemeris = \"" +
                          std::string(c.name) +
                          "\"\n"
                          "ephemeris_frame = \"J2000\"\nradii_m = [1e6, 1e6, 1e6]\n");
        scene::Scene s = scene::load_scene(scene_file);
        for (const bool deflection : {false, true}) {
            s.light_deflection = deflection;
            const renderer::ScenePoses poses(s);
            const Pose camera = poses.camera(later_s);
            const renderer::BodyView seen = poses.body(0, later_s);
            CHECK(angle(seen.pose.position_m - camera.position_m, c.astrometric) < 0.1 * mas);
            // The camera is aimed at the apparent place, in the middle of the picture.
            CHECK(angle(rotate(camera.orientation, {0, 0, 1}), deflection ? c.apparent : c.aberrated) <
                  0.1 * mas);
            REQUIRE(seen.pixel);
            CHECK(std::hypot(seen.pixel->x - 50, seen.pixel->y - 50) < 1e-6);
        }
    }
}

TEST_CASE("where a kernel holds no position the last one before it is shown, with its age") {
    const KernelScene files;
    // Uniform motion of 1 km/s in records of 100 s; that from 300 to 400 s is damaged, by a value that is no
    // number, or beyond any position.
    for (const double damage : {std::numeric_limits<double>::quiet_NaN(), 1e200}) {
        CAPTURE(damage);
        std::vector<double> words;
        for (int record = -1; record < 5; ++record) {
            const double middle = 100 * record + 50;
            words.insert(words.end(), {middle, 50, record == 3 ? damage : middle, 50, 20000, 0, 0, 0});
        }
        words.insert(words.end(), {-100, 100, 8, 6});
        files.write("craft.bsp", test::daf_bytes("SPK",
                                                 {{"DAMAGED", {-100, 500}, {-901, 599, 1, 2}, words},
                                                  uniform(10, 0, -1e5, 1e5, {-7e5, 5e5, 2e5}, {0, 0, 0}),
                                                  uniform(599, 0, -1e5, 1e5, {-3e8, 0, 0}, {0, 0, 0})},
                                                 false));
        files.write("craft.tm", "KPL/MK\n\\begindata\nKERNELS_TO_LOAD = ( 'rotations.tpc' 'craft.bsp' )\n");
        files.write("s.toml",
                    "epoch = \"2000-01-01T12:00:00 TDB\"\nkernels = \"craft.tm\"\ncentre = \"JUPITER\"\n"
                    "[[body]]\nname = \"craft\"\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.1\n"
                    "ephemeris = \"-901\"\nephemeris_frame = \"J2000\"\n");
        const scene::Scene scene = scene::load_scene(files.path() / "s.toml");
        const scene::PosePath& path = *scene.bodies.at(0).motion.path;
        CHECK(std::abs(path.at(150).position_m.x - 150e3) < 1e-3);
        CHECK(path.ages(150).position_s == 0);
        for (const double t : {310.0, 350.0, 399.0}) {
            const double age_s = path.ages(t).position_s;
            CHECK(age_s >= t - 300);
            CHECK(age_s <= 2 * (t - 300)); // doubled steps
            CHECK(std::abs(path.at(t).position_m.x - 1000 * (t - age_s)) < 1e-3);
            CHECK(path.velocity_m_s(t) == Vec3{});
        }
        CHECK(path.ages(450).position_s == 0);
        CHECK(std::abs(path.at(600).position_m.x - 500e3) < 1);
        CHECK(std::abs(path.ages(600).position_s - 100) < 1e-3);
    }
}

} // namespace kernel_scene_test
