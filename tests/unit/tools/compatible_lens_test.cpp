// SPDX-License-Identifier: Apache-2.0
// The published client's models of the camera beside formulas, transformations of objects, and pictures that
// follow each other on a body.
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/picture_file.hpp"
#include "tests/unit/tools/compatible_client.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace compatible_lens_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// One star in a direction of the camera frame x right, y up, z backward, in which the camera is at the
/// start.
void show_star(Client& client, Vec3 direction) {
    client.write("sky.txt",
                 fmt::format("1\n{:.17g} {:.17g} {:.17g} 1 1 1 1\n", direction.x, direction.y, direction.z));
    client.call("setBackground", {{"background", "sky.txt"}});
    client.place("sun", {0, 0, 1e13});
    client.irradiance(true);
}
void gaussian(Client& client, double sigma_px) {
    client.call("loadPSFModel", {{"filename", "gaussian.psf"}, {"parameters", Fields{{"sigma", sigma_px}}}});
}
Light light(Client& client, std::size_t width) {
    client.call("render");
    return light_of(client.numbers("getImageGray32F"), width);
}
/// Root mean square distance of the light from its centre, px.
double spread_px(const std::vector<float>& gray, std::size_t width) {
    const Light middle = light_of(gray, width);
    double sum = 0;
    for (std::size_t i = 0; i < gray.size(); ++i)
        sum += static_cast<double>(gray[i]) *
               (std::pow(static_cast<double>(i % width) + 0.5 - middle.column, 2) +
                std::pow(static_cast<double>(gray.size() / width - 1 - i / width) + 0.5 - middle.row, 2));
    return std::sqrt(sum / middle.sum);
}

} // namespace

TEST_CASE("a projection model puts a star where its formula says", "[serve]") {
    const double angle = 0.7, half = pi / 3, towards = 0.4;
    for (const auto& [name, shown, edge] :
         {std::tuple{"equidistant.prj", angle, half},
          std::tuple{"equisolid", 2 * std::sin(angle / 2), 2 * std::sin(half / 2)},
          std::tuple{"stereographic.x", 2 * std::tan(angle / 2), 2 * std::tan(half / 2)},
          std::tuple{"orthographic", std::sin(angle), std::sin(half)},
          std::tuple{"", std::tan(angle), std::tan(half)}}) {
        Client client;
        client.size(128, 128);
        client.fov_deg(120, 120);
        gaussian(client, 0.7);
        client.call("loadProjectionModel", {{"filename", name}, {"parameters", Fields{}}});
        client.call("enableLOSmapping", {{"b_enable", true}});
        const Vec3 to{std::sin(angle) * std::cos(towards), std::sin(angle) * std::sin(towards),
                      -std::cos(angle)};
        show_star(client, to);
        const Light seen = light(client, 128);
        const double r = 64 / edge * shown, column = 64 + r * std::cos(towards),
                     row = 64 - r * std::sin(towards);
        CHECK_THAT(seen.column, WithinAbs(column, 0.03));
        CHECK_THAT(seen.row, WithinAbs(row, 0.03));
        // The line of sight of the pixel beside is as far from the star as the pixel's centre.
        const std::vector<float> los = client.numbers("getLOSMap");
        const auto pixel = static_cast<std::size_t>((127 - std::floor(row)) * 128 + std::floor(column));
        const Vec3 line{static_cast<double>(los[3 * pixel]), static_cast<double>(los[3 * pixel + 1]),
                        static_cast<double>(los[3 * pixel + 2])};
        CHECK_THAT(length(line), WithinAbs(1, 1e-6));
        CHECK(length(line - to) < 0.03);
    }
}

TEST_CASE("a projection in SuMoL is used with its parameters", "[serve]") {
    Client client;
    std::ofstream(client.folder.path() / "own.prj")
        << "parameter k1 0;\nparameter max_angle 80; //! deg, 1..180, not seen beyond\n"
           "vec2 point(vec3 d)\n{\n"
           "    scalar s = max(length(d.xy), 1e-300);\n    scalar t = atan2(s, d.z);\n"
           "    if (t > max_angle) return vec2(M_NAN);\n"
           "    return d.xy * (focal_length * t * (1 + k1 * t * t) / s);\n}\n";
    client.size(128, 128);
    client.fov_deg(120, 120);
    gaussian(client, 0.7);
    client.call("loadProjectionModel",
                {{"filename", "own.prj"}, {"parameters", Fields{{"k1", -0.1}, {"max_angle", 1.5}}}});
    client.call("enableLOSmapping", {{"b_enable", true}});
    const double angle = 0.7, half = pi / 3, towards = 0.4;
    const auto radius = [](double t) { return t * (1 - 0.1 * t * t); };
    const Vec3 to{std::sin(angle) * std::cos(towards), std::sin(angle) * std::sin(towards), -std::cos(angle)};
    show_star(client, to);
    const Light seen = light(client, 128);
    const double r = 64 / radius(half) * radius(angle), column = 64 + r * std::cos(towards),
                 row = 64 - r * std::sin(towards);
    CHECK_THAT(seen.column, WithinAbs(column, 0.03));
    CHECK_THAT(seen.row, WithinAbs(row, 0.03));
    const std::vector<float> los = client.numbers("getLOSMap");
    const auto pixel = static_cast<std::size_t>((127 - std::floor(row)) * 128 + std::floor(column));
    const Vec3 line{static_cast<double>(los[3 * pixel]), static_cast<double>(los[3 * pixel + 1]),
                    static_cast<double>(los[3 * pixel + 2])};
    CHECK_THAT(length(line), WithinAbs(1, 1e-6));
    CHECK(length(line - to) < 0.03);
    client.refuse("setCameraFOVDeg", {{"fov_x", 175.0}, {"fov_y", 100.0}},
                  "a field that the projection shows");
    client.refuse("loadProjectionModel",
                  {{"filename", "own.prj"}, {"parameters", Fields{{"max_angle", 0.8}}}}, "too wide");
    std::ofstream(client.folder.path() / "bad.prj") << "vec2 point(vec3 d) { return d; }\n";
    client.refuse("loadProjectionModel", {{"filename", "bad.prj"}, {"parameters", Fields{}}}, "bad.prj:1:");
}

TEST_CASE("distortion of Brown and Conrady is from the real picture to the ideal one", "[serve]") {
    Client client;
    client.size(128, 128);
    client.fov_deg(40, 40);
    gaussian(client, 0.7);
    client.call("loadProjectionModel",
                {{"filename", "pinhole"}, {"parameters", Fields{{"k1", 0.2}, {"k2", -0.1}, {"p1", 0.01}}}});
    const double f_px = 64 / std::tan(20 * pi / 180), x = 30 / f_px, y = -20 / f_px, r2 = x * x + y * y;
    const double radial = 1 + 0.2 * r2 - 0.1 * r2 * r2;
    show_star(client, {x * radial + 0.01 * (r2 + 2 * x * x), -(y * radial + 2 * 0.01 * x * y), -1});
    const Light seen = light(client, 128);
    CHECK_THAT(seen.column, WithinAbs(94, 0.03));
    CHECK_THAT(seen.row, WithinAbs(44, 0.03));
    client.refuse("loadProjectionModel", {{"filename", "stereo.txr"}, {"parameters", Fields{}}},
                  "and pinhole, equidistant, equisolid, stereographic, orthographic, with any ending");
    client.call("loadProjectionModel", {{"filename", "equidistant"}, {"parameters", Fields{}}});
    client.fov_deg(200, 200);
    client.refuse("loadProjectionModel", {{"filename", "pinhole"}, {"parameters", Fields{}}}, "too wide");
}

TEST_CASE("defocus blurs a star to a disc, and leaves the plane of focus sharp", "[serve]") {
    const double f_px = 32 / std::tan(2 * pi / 180), focus_m = 2, pupil_m = 0.02;
    const auto focus = [&](Client& client, double at_m) {
        client.call("setFocus", {{"focus_plane_Z", -at_m}, {"pupil_radius", pupil_m}});
    };
    Client client;
    client.size(64, 64);
    client.fov_deg(4, 4);
    client.samples(16);
    gaussian(client, 1);
    show_star(client, {0, 0, -1});
    const double sharp_px = (void(light(client, 64)), spread_px(client.numbers("getImageGray32F"), 64));
    focus(client, focus_m);
    const Light blurred = light(client, 64);
    // A disc of even light, with the blur of the PSF.
    const double radius_px = f_px * pupil_m / focus_m;
    CHECK_THAT(spread_px(client.numbers("getImageGray32F"), 64),
               WithinRel(std::hypot(sharp_px, radius_px / std::sqrt(2.0)), 0.02));
    CHECK_THAT(blurred.sum, WithinRel(1.0, 0.02));
    CHECK_THAT(blurred.column, WithinAbs(32, 0.1));
    client.call("setFocus", {{"focus_plane_Z", 0.0}, {"pupil_radius", pupil_m}});
    (void)light(client, 64);
    CHECK_THAT(spread_px(client.numbers("getImageGray32F"), 64), WithinRel(sharp_px, 1e-6));

    // A ball in the plane of focus, and one at half of the distance: blurred as much as what is infinitely
    // far.
    for (const auto& [at_m, blur_px] : {std::pair{2.0, 0.0}, std::pair{1.0, radius_px}}) {
        Client near;
        near.size(64, 64);
        near.fov_deg(4, 4);
        near.samples(16);
        near.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
        near.ball("ball", 0.004 * at_m, {0, 0, -at_m});
        (void)light(near, 64);
        const double alone_px = spread_px(near.numbers("getImageGray32F"), 64);
        focus(near, focus_m);
        (void)light(near, 64);
        CHECK_THAT(spread_px(near.numbers("getImageGray32F"), 64),
                   WithinRel(std::hypot(alone_px, blur_px / std::sqrt(2.0)), 0.03));
        const std::vector<double> depth = near.numbers<double>("getDepthMap");
        CHECK_THAT(depth[32 * 64 + 32], WithinRel(at_m * 0.996, 1e-3));
    }
}

TEST_CASE("a rolling shutter exposes its rows one after the other", "[serve]") {
    Client client;
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 2, {-0.6, 0, -20});
    client.size(64, 64);
    client.fov_deg(20, 20);
    client.samples(64);
    client.call("setIntegrationTime", {{"integration_time", 0.002}});
    client.call("setObjectMotion",
                {{"object_name", "ball"}, {"motion", List{List{2.0, 0, 0}, List{0, 0, 0}}}});
    client.call("loadTimeSamplingModel",
                {{"filename", "rolling_shutter"}, {"parameters", Fields{{"line_addressing_time", 0.01}}}});
    client.call("enableTimeMapping", {{"b_enable", true}});
    client.call("render");
    const std::vector<float> gray = client.numbers("getImageGray32F"), times = client.numbers("getTimeMap");
    const double f_px = 32 / std::tan(10 * pi / 180);
    for (const std::size_t row : {26U, 32U, 38U}) {
        const double time_s = 0.001 + 0.01 * static_cast<double>(row);
        CHECK_THAT(static_cast<double>(times[(63 - row) * 64 + 5]), WithinAbs(time_s, 1e-6));
        const auto begin = gray.begin() + static_cast<std::ptrdiff_t>((63 - row) * 64);
        const Light seen = light_of({begin, begin + 64}, 64);
        CHECK_THAT(seen.column, WithinAbs(32 + f_px * (-0.6 + 2 * time_s) / 20, 0.1));
    }
    client.call("loadTimeSamplingModel", {{"filename", ""}, {"parameters", Fields{}}});
    client.call("render");
    CHECK(client.numbers("getTimeMap").front() == 0.001F);
}

TEST_CASE("a motion model moves the camera in its own frame", "[serve]") {
    Client client;
    client.size(64, 64);
    client.fov_deg(20, 20);
    gaussian(client, 0.7);
    show_star(client, {0, 0, -1});
    // A turn about the axis that points right: the camera looks up, so that the star is lower.
    const double turn = 0.05;
    client.write("motion.csv", fmt::format("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,{:.17g},{:.17g},0,0\n",
                                           std::cos(turn / 2), std::sin(turn / 2)));
    client.call("loadMotionModel", {{"filename", "motion.csv"}, {"parameters", Fields{}}});
    const double f_px = 32 / std::tan(10 * pi / 180);
    CHECK_THAT(light(client, 64).row, WithinAbs(32 + f_px * std::tan(turn), 0.03));
    // As much the other way during the exposure: in the mean the star is in the middle, smeared.
    client.write("motion.csv", fmt::format("time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,0,{0:.17g},{1:.17g},0,0\n"
                                           "0.01,0,0,0,{0:.17g},-{1:.17g},0,0\n",
                                           std::cos(turn / 2), std::sin(turn / 2)));
    client.call("loadMotionModel", {{"filename", "motion.csv"}, {"parameters", Fields{}}});
    client.call("setIntegrationTime", {{"integration_time", 0.01}});
    CHECK_THAT(light(client, 64).row, WithinAbs(32, 0.1));
    CHECK_THAT(spread_px(client.numbers("getImageGray32F"), 64),
               WithinRel(std::hypot(2 * f_px * turn / std::sqrt(12.0), 0.7 * std::sqrt(2.0)), 0.05));
    client.call("loadMotionModel", {{"filename", ""}, {"parameters", Fields{}}});
    CHECK_THAT(light(client, 64).row, WithinAbs(32, 0.03));
    client.refuse("loadMotionModel", {{"filename", "motion.lua"}, {"parameters", Fields{}}}, "a table .csv");
}

TEST_CASE("a spectrum model sets the wavelengths of the channels", "[serve]") {
    Client client;
    serve::compatible::CompatibleSettings settings;
    settings.root = client.folder.path();
    serve::compatible::ClientState client_state(settings, client.memory);
    Unhurried work;
    const auto load = [&](const char* name, const Fields& parameters) {
        const Command& command = *find_command("loadSpectrumModel");
        const Fields arguments{{"filename", name}, {"parameters", parameters}};
        Reply reply;
        serve::compatible::Request request{command, client_state, Arguments(command, arguments), reply, work};
        serve::compatible::handlers().at("loadSpectrumModel")(request);
    };
    load("bands.txr", {{"from", List{4e-7, 5e-7, 6e-7, 7e-7}}, {"to", List{4.5e-7, 5.5e-7, 6.5e-7, 8e-7}}});
    const nlohmann::json bands = client_state.scene()["band"];
    for (std::size_t c = 0; c < 4; ++c)
        CHECK_THAT(bands[c]["from_nm"].get<double>(),
                   WithinRel(400.0 + 100.0 * static_cast<double>(c), 1e-12));
    CHECK_THAT(bands[3]["to_nm"].get<double>(), WithinRel(800.0, 1e-12));
    CHECK_THROWS_AS(load("bands", {{"from", List{4e-7, 5e-7, 6e-7, 7e-7}}}), Failure);
    CHECK_THROWS_AS(load("bands", {{"from", List{0.0, 5e-7, 6e-7, 7e-7}}, {"to", List{1.0, 1.0, 1.0, 1.0}}}),
                    Failure);
    load("", {});
    CHECK(client_state.scene()["band"][0]["from_nm"] == 600.0);
}

TEST_CASE("the transformation of a whole object acts in its frame, whose place stays", "[serve]") {
    Client client;
    client.size(64, 64);
    client.fov_deg(30, 30);
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 1, {2, 1, -20});
    // A quarter turn about z: x of the ball is y of the scene.
    const double half = std::sqrt(0.5);
    client.turn("ball", {0.0, 0.0, half, half});
    const auto transform = [](double scale, Vec3 to) {
        // A quarter turn about z again.
        return List{List{0.0, -scale, 0.0, to.x}, List{scale, 0.0, 0.0, to.y}, List{0.0, 0.0, scale, to.z},
                    List{0.0, 0.0, 0.0, 1.0}};
    };
    const auto set = [&](const char* element, const List& matrix, bool relative = false) {
        return Fields{
            {"object_name", "ball"}, {"element_name", element}, {"matrix", matrix}, {"relative", relative}};
    };
    // Columns and rows of a pinhole: 32 + f x / -z, 32 - f y / -z. The lit side is up to 1 m nearer: 0.4 px.
    const double f = 32 / std::tan(pi / 12);
    const auto seen_at = [&](double x, double y) {
        const Light seen = light(client, 64);
        CHECK_THAT(seen.column, WithinAbs(32 + f * x / 20, 0.5));
        CHECK_THAT(seen.row, WithinAbs(32 - f * y / 20, 0.5));
    };
    const Value before = client.ask("getObjectAttitude", "attitude", {{"object_name", "ball"}});
    seen_at(2, 1);
    // The identity moves nothing.
    const List identity{List{1.0, 0.0, 0.0, 0.0}, List{0.0, 1.0, 0.0, 0.0}, List{0.0, 0.0, 1.0, 0.0},
                        List{0.0, 0.0, 0.0, 1.0}};
    client.call("setObjectElementTransform", set("ball", identity));
    seen_at(2, 1);
    // 2 m along x of the ball's frame are 2 m along y of the scene's, whichever name says all of it.
    client.call("setAlias", {{"object_name", "ball"}, {"alias", "globe"}});
    for (const char* element : {"ball", "globe", ""})
        for (const bool relative : {false, true}) {
            client.call("setObjectElementTransform", set("ball", identity));
            client.call("setObjectElementTransform", set(element, transform(1, {2, 0, 0}), relative));
            seen_at(2, 3);
        }
    CHECK(client.ask("getObjectPosition", "pos", {{"object_name", "ball"}}) == Value(List{2.0, 1.0, -20.0}));
    CHECK(client.ask("getObjectAttitude", "attitude", {{"object_name", "ball"}}) == before);
    // A state brings it back; a place set later goes below it; a new object has none.
    const Value state = client.ask("getState", "state");
    client.call("setObjectElementTransform", set("ball", identity));
    client.call("setState", {{"state", state}});
    client.place("ball", {-2, -1, -20});
    seen_at(-2, 1);
    client.ball("ball", 1, {-2, -1, -20});
    seen_at(-2, -1);
    client.refuse("setObjectElementTransform", set("ball", transform(2, {})), "a scale");
    client.refuse("setObjectElementTransform", set("ball", transform(-1, {})), "a reflection");
    client.refuse("setObjectElementTransform", set("part", transform(1, {})), "cannot be told apart");
    client.refuse("setObjectElementTransform", set("ball", List{1.0}), "no list of 4 rows");
}

TEST_CASE("the transformation of the camera acts in the axes of its convention", "[serve]") {
    for (const int convention : {0, 1}) {
        Client client;
        client.size(64, 64);
        client.fov_deg(30, 30);
        client.call("setConventions", {{"quaternion_convention", 0}, {"camera_convention", convention}});
        client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
        client.ball("ball", 1, {0, 0, -20});
        // 1 m along the camera's y: up in convention 0, down in 1.
        client.call("setObjectElementTransform",
                    {{"object_name", "camera"},
                     {"element_name", "camera"},
                     {"matrix", List{List{1.0, 0.0, 0.0, 0.0}, List{0.0, 1.0, 0.0, 1.0},
                                     List{0.0, 0.0, 1.0, 0.0}, List{0.0, 0.0, 0.0, 1.0}}},
                     {"relative", true}});
        const double f = 32 / std::tan(pi / 12);
        CHECK_THAT(light(client, 64).row, WithinAbs(convention == 0 ? 32 + f / 20 : 32 - f / 20, 0.15));
    }
}

TEST_CASE("pictures of a sequence follow each other on the body that wears it", "[serve]") {
    for (const bool loop : {false, true}) {
        Client client;
        for (const auto& [number, value] : {std::pair{1, 1.0F}, std::pair{2, 0.4F}})
            serve::compatible::save_integers(client.folder.path() / fmt::format("film_{:03}.png", number),
                                             {2, 1, {{value, value}}, ""}, 8);
        client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
        client.ball("ball", 1, {0, 0, -10});
        client.size(16, 16);
        client.fov_deg(8, 8);
        client.call("createVideoTexture", {{"name", "film"}, {"filename", "film_%03d.png"}, {"loop", loop}});
        client.call("attachDynamicTexture", {{"object_name", "ball"},
                                             {"element_name", "ball"},
                                             {"texture_name", "film"},
                                             {"texture_unit_id", 0}});
        std::vector<double> seen;
        for (int i = 0; i < 4; ++i) {
            seen.push_back(light(client, 16).sum);
            client.call("updateDynamicTexture", {{"name", "film"}});
        }
        CHECK_THAT(seen[1] / seen[0], WithinRel(0.4, 0.01));
        CHECK_THAT(seen[2] / seen[0], WithinRel(loop ? 1.0 : 0.4, 0.01));
        CHECK_THAT(seen[3] / seen[0], WithinRel(0.4, 0.01));
        client.refuse("createVideoTexture", {{"name", "film"}, {"filename", "film.avi"}, {"loop", loop}},
                      "allowed a sequence of pictures");
        client.refuse("createVideoTexture", {{"name", "film"}, {"filename", "other_%d.png"}, {"loop", loop}},
                      "other_1.png");
    }
}

} // namespace compatible_lens_test
