// SPDX-License-Identifier: Apache-2.0
// Places on bodies by longitude, latitude and height, against PROJ and plane trigonometry; aims at landmarks.
#include "core/units.hpp"
#include "renderer/scene/sky_object.hpp"
#include "renderer/world/build.hpp"
#include "renderer/world/kinematics.hpp"
#include "renderer/world/motion.hpp"
#include "renderer/world/scene_poses.hpp"
#include "renderer/world/view.hpp"
#include "scene_texts.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <cmath>
#include <string>

namespace surface_places_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;

namespace {

/// Mars' ellipsoid, which turns.
constexpr const char* mars =
    "[[body]]\nname = \"mars\"\nshape = \"ellipsoid\"\nradii_m = [3396190, 3396190, 3376200]\nalbedo = 0.2\n"
    "position_m = [1e7, 0, 0]\nspin_rate_deg_per_s = 0.004\n";
constexpr const char* moon =
    "[[body]]\nname = \"moon\"\nshape = \"planet\"\nradii_m = [1737400, 1737400, 1737400]\nmaterial = \"moon\"\n"
    "[body.detail]\nterrain = \"highlands\"\n";

void check_near(Vec3 a, Vec3 b, double tolerance) {
    CHECK_THAT(a.x, WithinAbs(b.x, tolerance));
    CHECK_THAT(a.y, WithinAbs(b.y, tolerance));
    CHECK_THAT(a.z, WithinAbs(b.z, tolerance));
}

Vec3 z_axis(Quat q) {
    return rotate(q, {0, 0, 1});
}

/// Range along the boresight of a camera with an odd number of pixels.
double range_m(const scene::Scene& s) {
    const renderer::Renderer r(s, {1, 2, 1});
    const Region window{s.camera.width / 2, s.camera.height / 2, 1, 1};
    const std::vector<RowTime> times(1);
    renderer::RenderRequest request;
    request.window = window;
    request.rows = 1;
    request.row_times = times;
    std::vector<float> aovs(renderer::aov_count);
    CHECK(r.render_aovs(request, aovs));
    return static_cast<double>(aovs[static_cast<std::size_t>(renderer::Aov::range_m)]);
}

} // namespace

TEST_CASE("places by planetographic latitude are those of PROJ, by planetocentric those of a polar ellipse") {
    const SceneTexts files;
    const auto place = [&](const std::string& what, const std::string& keys) {
        const scene::Scene s = files.scene(what + "parent = \"mars\"\n" + keys + mars);
        return what == "[camera]\n" ? s.camera.motion.samples[0].pose.position_m
               : what == "[[body]]\nshape = \"box\"\nsize_m = [1, 1, 1]\nalbedo = 0.5\n"
                   ? s.bodies[0].motion.samples[0].pose.position_m
               : what == "[[lamp]]\nintensity_w_sr = [1]\n"
                   ? s.lamps[0].motion.samples[0].pose.position_m
                   : s.sky_objects->at(0).motion.samples[0].pose.position_m;
    };
    for (const char* what :
         {"[camera]\n", "[[body]]\nshape = \"box\"\nsize_m = [1, 1, 1]\nalbedo = 0.5\n",
          "[[lamp]]\nintensity_w_sr = [1]\n", "[[sky_object]]\nkind = \"point\"\nv_mag = 3\n"}) {
        INFO(what);
        // gdaltransform -s_srs "+proj=longlat +a=3396190 +b=3376200" -t_srs "+proj=geocent ..." (PROJ 9.1)
        const std::string graphic = "latitudes = \"planetographic\"\n";
        check_near(
            place(what, graphic + "longitude_deg = 137.4417\nlatitude_deg = -4.5895\naltitude_m = -4501\n"),
            {-2490365.69127627, 2286665.80158776, -268210.704230768}, 1e-6);
        check_near(place(what, graphic + "longitude_deg = 290\nlatitude_deg = 85\naltitude_m = 1200\n"),
                   {101867.682221629, -279879.156676104, 3364396.26709287}, 1e-6);
        check_near(place(what, graphic + "longitude_deg = 0\nlatitude_deg = -90\naltitude_m = 10\n"),
                   {0, 0, -3376210}, 1e-6);
        // r = a b / sqrt((b cos)^2 + (a sin)^2), plus the height along the radius.
        check_near(place(what, "longitude_deg = 137.4417\nlatitude_deg = -4.5895\naltitude_m = -4501\n"),
                   {-2490177.187065, 2286492.716111, -271379.915876}, 1e-5);
    }
}

TEST_CASE("a thing that is placed on a body turns with it, its local axes are east, north and up") {
    const SceneTexts files;
    const scene::Scene s =
        files.scene(std::string(mars) +
                    "[[body]]\nname = \"rover\"\nshape = \"box\"\nsize_m = [2, 3, 1]\nalbedo = 0.5\n"
                    "parent = \"mars\"\nlongitude_deg = 60\nlatitude_deg = 30\naxes = \"east-north-up\"\n"
                    "[camera]\nparent = \"mars\"\nlongitude_deg = 60\nlatitude_deg = 30\naltitude_m = 2\n"
                    "axes = \"east-north-up\"\nboresight = [0, 1, 0]\n");
    const renderer::ScenePoses poses(s);
    for (const double t : {0.0, 22500.0}) {
        // 90 degrees in 22500 s.
        const double lon = 60 * degree + t * 0.004 * degree, lat = 30 * degree;
        const Vec3 east{-std::sin(lon), std::cos(lon), 0};
        const Vec3 north{-std::sin(lat) * std::cos(lon), -std::sin(lat) * std::sin(lon), std::cos(lat)};
        const Vec3 up{std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
        const Pose rover = poses.body(1, t).pose, camera = poses.camera(t);
        check_near(rotate(rover.orientation, {1, 0, 0}), east, 1e-9);
        check_near(rotate(rover.orientation, {0, 1, 0}), north, 1e-9);
        check_near(rotate(rover.orientation, {0, 0, 1}), up, 1e-9);
        check_near(z_axis(camera.orientation), north, 1e-9);
        check_near(rotate(camera.orientation, {0, -1, 0}), up, 1e-9); // up in the image
        check_near(camera.position_m - rover.position_m, 2 * up, 1e-6);
    }
}

TEST_CASE("a trajectory over a body keeps its height between rows, along the great circle") {
    const SceneTexts files;
    (void)files.write("t.csv", "time_s,longitude_deg,latitude_deg,altitude_m\n0,350,0,1000\n10,10,0,3000\n"
                               "20,10,60,3000\n30,190,60,3000\n");
    const scene::Scene s = files.scene(
        "[camera]\nparent = \"ball\"\ntrajectory = \"t.csv\"\naxes = \"east-north-up\"\nboresight = [0, 0, -1]\n"
        "[[body]]\nname = \"ball\"\nshape = \"ellipsoid\"\nradii_m = [1e6, 1e6, 1e6]\nalbedo = 0.2\n");
    const auto at = [&](double t) { return renderer::pose_at(s.camera.motion, t).position_m; };
    check_near(at(0), 1001000 * Vec3{std::cos(10 * degree), -std::sin(10 * degree), 0}, 1e-6);
    check_near(at(5), {1002000, 0, 0}, 1e-6);
    check_near(at(15),
               1003000 * Vec3{std::cos(10 * degree) * std::cos(30 * degree),
                              std::sin(10 * degree) * std::cos(30 * degree), std::sin(30 * degree)},
               1e-6);
    check_near(at(25), {0, 0, 1003000}, 1e-6); // over the pole
    check_near(at(99), at(30), 0);
    // The camera looks down all the way.
    for (const double t : {0.0, 3.0, 17.0, 22.0, 28.0, 40.0})
        check_near(z_axis(renderer::pose_at(s.camera.motion, t).orientation), -normalized(at(t)), 1e-9);
    // 20 degrees in 10 s at 1001 to 1003 km, and 200 m/s up.
    const Vec3 v = renderer::scripted_velocity_m_s(s.camera.motion, 5);
    check_near(v, {200, 1002000 * 2 * degree, 0}, 3e-2);
    CHECK(renderer::scripted_velocity_m_s(s.camera.motion, 31) == Vec3{});
}

TEST_CASE("a height above the ground is the range at which a camera that looks down sees the ground") {
    const SceneTexts files;
    const std::string camera = "[camera]\nwidth = 5\nheight = 5\nfocal_length_mm = 50\nparent = \"moon\"\n"
                               "longitude_deg = -21.3\nlatitude_deg = 41.7\naxes = \"east-north-up\"\n"
                               "boresight = [0, 0, -1]\naltitude_above = \"ground\"\n";
    // The ground's slopes within a pixel of 0.4 mrad make some millimetres.
    CHECK_THAT(range_m(files.scene(camera + "altitude_m = 2\n" + moon)), WithinAbs(2, 0.02));
    CHECK_THAT(range_m(files.scene(camera + "altitude_m = 150\n" + moon)), WithinAbs(150, 0.2));
    // The camera is not taken to be inside the ground, whose coarse levels are hundreds of metres off.
    const auto inside = [&](double height_m) {
        const scene::Scene s = files.scene(fmt::format("{}altitude_m = {}\n{}", camera, height_m, moon));
        return renderer::Renderer(s, {1, 2, 1}).view(Time{}).bodies.at(0).around_camera;
    };
    CHECK_FALSE(inside(0.1));
    CHECK(inside(-0.1));
    // Bodies without a reference ellipsoid have a ground, too: the top of a box.
    const scene::Scene box = files.scene(
        "[camera]\nparent = \"moon\"\nlongitude_deg = 90\nlatitude_deg = 0\naltitude_m = 5\n"
        "altitude_above = \"ground\"\n[[body]]\nname = \"moon\"\nshape = \"box\"\nsize_m = [2, 6, "
        "4]\nalbedo = 0.5\n");
    check_near(box.camera.motion.samples[0].pose.position_m, {0, 8, 0}, 1e-9);
}

TEST_CASE("look_at takes a landmark, which stays in the principal point while its body turns") {
    const SceneTexts files;
    const std::string landmarks =
        "[[landmark]]\nname = \"gale\"\nbody = \"mars\"\nlongitude_deg = 190\nlatitude_deg = 20\n"
        "[[landmark]]\nname = \"peak\"\nbody = \"mars\"\nposition_m = [-3.4e6, 1e5, 2e5]\n"
        "[[landmark]]\nname = \"graphic\"\nbody = \"mars\"\nlongitude_deg = 180\nlatitude_deg = -40\n"
        "latitudes = \"planetographic\"\n";
    for (const char* name : {"gale", "peak", "graphic"})
        for (const char* light : {"light_time = false\n", "light_time = true\naberration = true\n"}) {
            INFO(name << ' ' << light);
            const scene::Scene s =
                files.scene(std::string(light) +
                            "[camera]\nwidth = 101\nheight = 101\nfocal_length_mm = 200\n"
                            "position_m = [-1e7, 3e6, 0]\nlook_at = \"" +
                            name + "\"\nup = [0, 0, 1]\nvelocity_m_s = [0, 30000, 0]\n" + mars + landmarks);
            const renderer::Renderer r(s, {1, 2, 1});
            for (const double t : {0.0, 2500.0}) {
                const auto entries = truth_entries(r, TruthKind::landmark, 101, Time{std::llround(t * 1e9)});
                bool found = false;
                for (const TruthEntry& e : entries) {
                    if (e.name.view() != name) continue;
                    found = true;
                    CHECK_THAT(e.x_px, WithinAbs(50, 2e-3));
                    CHECK_THAT(e.y_px, WithinAbs(50, 2e-3));
                    if (std::string_view(name) == "graphic") // tan of centric = (b / a)^2 tan of graphic
                        CHECK_THAT(
                            std::tan(e.latitude_deg * degree),
                            WithinAbs(std::pow(3376200.0 / 3396190, 2) * std::tan(-40 * degree), 1e-9));
                }
                CHECK(found);
            }
        }
    CHECK(files.refusal(std::string("[camera]\nlook_at = \"gael\"\n") + mars + landmarks) ==
          "s.toml:2:11: camera.look_at: \"gael\" is no body or landmark of the scene; there are mars, gale, "
          "peak, graphic, sun; did you mean \"gale\"?");
}

TEST_CASE("what does not fit a place on a body is refused with file, key and what is allowed") {
    const SceneTexts files;
    (void)files.write("t.csv", "time_s,longitude_deg,latitude_deg,altitude_m\n0,0,0,0\n");
    (void)files.write("bad.csv", "time_s,longitude_deg,latitude_deg,altitude_m\n0,0,91,0\n");
    const auto refusal = [&](const std::string& keys) { return files.refusal("[camera]\n" + keys + mars); };
    const std::string place = "longitude_deg = 1\nlatitude_deg = 2\n", on = "parent = \"mars\"\n";
    CHECK(refusal(place) == "s.toml:2:17: camera.longitude_deg: needs \"parent\", the body that it is on");
    CHECK(refusal(place + "relative_to = \"mars\"\n") ==
          "s.toml:2:17: camera.longitude_deg: needs \"parent\", the body that it is on; \"relative_to\" does "
          "not turn with it");
    CHECK(refusal(on + "longitude_deg = 1\n") == "s.toml:1:2: camera: the key \"latitude_deg\" is missing");
    CHECK(refusal(on + place + "position_m = [1, 2, 3]\n") ==
          "s.toml:3:17: camera.longitude_deg: cannot stand beside \"position_m\"\n"
          "s.toml:4:16: camera.latitude_deg: cannot stand beside \"position_m\"");
    CHECK(refusal("altitude_m = 4\n") ==
          "s.toml:2:14: camera.altitude_m: belongs to \"longitude_deg\" and \"latitude_deg\"");
    CHECK(refusal(on + "longitude_deg = 1\nlatitude_deg = 91\n") ==
          "s.toml:4:16: camera.latitude_deg: 91 is out of range, allowed -90 to 90 deg");
    CHECK(refusal(on + "trajectory = \"bad.csv\"\n") == "bad.csv:2:5: latitude_deg: 91 is outside -90 to 90");
    CHECK(refusal(on + "trajectory = \"t.csv\"\nmax_extrapolation_s = 5\n") ==
          "s.toml:4:23: camera.max_extrapolation_s: belongs to a trajectory in metres or to \"attitude\": "
          "places by longitude hold");
    CHECK(refusal(on + place + "latitudes = \"geodetic\"\n") ==
          "s.toml:5:13: camera.latitudes: \"geodetic\" is not known, allowed planetocentric, planetographic");
    const std::string box = "[[body]]\nname = \"mars\"\nshape = \"box\"\nsize_m = [1, 1, 1]\nalbedo = 0.5\n";
    CHECK(files.refusal("[camera]\n" + on + place + box) ==
          "s.toml:1:2: camera.longitude_deg: body 'mars' is a box, which has no reference ellipsoid; allowed "
          "are altitude_above = \"ground\" with planetocentric latitudes, or a parent of shape ellipsoid or "
          "planet");
    CHECK(files.refusal("[[lamp]]\nintensity_w_sr = [1]\nparent = \"camera\"\n" + place) ==
          "s.toml:1:1: lamp[0].longitude_deg: the camera has no longitudes; allowed is a body as parent");
}

} // namespace surface_places_test
