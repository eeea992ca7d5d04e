// SPDX-License-Identifier: Apache-2.0
// The published client's pictures beside formulas: light, geometry, stars, and the forms they are sent in.
#include "serve/compatible/handlers.hpp"
#include "serve/render_call.hpp"
#include "tests/unit/tools/compatible_client.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

namespace compatible_pictures_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEST_CASE("a white sphere with the Sun behind the camera has radiance 1", "[serve]") {
    Client client;
    const double distance_m = 1.2 * au_m;
    client.sun(6.957e8, {0, 0, distance_m}, pi * au_m * au_m);
    client.ball("ball", 1, {0, 0, -10});
    client.size(65, 65);
    client.fov_deg(20, 20);
    client.samples(64);
    client.call("render");
    const std::vector<float> image = client.numbers("getImage");
    REQUIRE(image.size() == 65 * 65 * 4);
    for (std::size_t c = 0; c < 4; ++c)
        CHECK_THAT(static_cast<double>(image[(32 * 65 + 32) * 4 + c]), WithinRel(1 / 1.44, 0.01));
    const auto bytes = client.numbers<std::uint8_t>("getImageRGBA8");
    CHECK(static_cast<int>(bytes[(32 * 65 + 32) * 4]) ==
          std::lround(255 * static_cast<double>(image[(32 * 65 + 32) * 4])));
}

TEST_CASE("the light of the Sun's small disc is all in the picture", "[serve]") {
    for (const bool gaussian : {false, true}) {
        Client client;
        const double f_px = 32 / std::tan(20 * pi / 180), distance_m = au_m;
        client.sun(distance_m * 0.6 / f_px, {0, 0, -distance_m}, 1e3 * distance_m * distance_m);
        client.size(64, 64);
        client.fov_deg(40, 40);
        client.irradiance(true);
        if (gaussian)
            client.call("loadPSFModel", {{"filename", "gaussian.psf"},
                                         {"parameters", Fields{{"sigma", 0.6}, {"epsilon", 1e-2}}}});
        client.call("render");
        CHECK_THAT(light_of(client.numbers("getImageGray32F"), 64).sum, WithinRel(1e3, 0.01));
    }
}

TEST_CASE("the Sun's light is free in each channel", "[serve]") {
    Client client;
    client.sun(6.957e8, {0, 0, au_m}, 1);
    const double p = pi * au_m * au_m;
    client.call("setSunPower", {{"sun_color", List{p, 2 * p, 0.0, 0.5 * p}}});
    client.ball("ball", 1, {0, 0, -10});
    client.size(33, 33);
    client.fov_deg(10, 10);
    client.samples(64);
    client.call("render");
    const std::vector<float> image = client.numbers("getImage");
    const double expected[]{1, 2, 0, 0.5};
    for (std::size_t c = 0; c < 4; ++c)
        CHECK_THAT(static_cast<double>(image[(16 * 33 + 16) * 4 + c]), WithinAbs(expected[c], 0.02));
    const List power = numbers_of(client.ask("getSunPower", "sun_power"));
    CHECK(number_of(power[1]) == 2 * p);
    client.call("setSunPowerAtDistance", {{"sun_color", List{1, 1, 1, 1}}, {"distance", 2.0}});
    CHECK(number_of(numbers_of(client.ask("getSunPower", "sun_power"))[0]) == 4);
}

TEST_CASE("the disc of a sphere has its angular radius, about the principal point", "[serve]") {
    Client client;
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 1, {0, 0, -8});
    client.size(256, 256);
    client.fov_deg(30, 30);
    client.samples(32);
    client.call("render");
    const double f_px = 128 / std::tan(15 * pi / 180);
    const std::vector<double> depth = client.numbers<double>("getDepthMap");
    const auto seen = std::count_if(depth.begin(), depth.end(), [](double d) { return std::isfinite(d); });
    CHECK_THAT(std::sqrt(static_cast<double>(seen) / pi),
               WithinAbs(f_px * std::tan(std::asin(1 / 8.0)), 0.1));
    const Light light = light_of(client.numbers("getImageGray32F"), 256);
    CHECK_THAT(light.column, WithinAbs(128, 0.02));
    CHECK_THAT(light.row, WithinAbs(128, 0.02));
    CHECK_THAT(*std::min_element(depth.begin(), depth.end()), WithinAbs(7, 1e-4));
}

TEST_CASE("two fields of view are two focal lengths", "[serve]") {
    Client client;
    const double across = std::tan(15 * pi / 180), down = std::tan(10 * pi / 180);
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 0.02, Vec3{across, -down, -1} * 20); // right and below
    client.size(640, 480);
    client.fov_deg(40, 30);
    client.samples(16);
    client.call("render");
    const Light light = light_of(client.numbers("getImageGray32F"), 640);
    CHECK_THAT(light.column, WithinAbs(320 + 879.19 * across, 0.3));
    CHECK_THAT(light.row, WithinAbs(240 + 895.69 * down, 0.3));
    const List fov = numbers_of(client.ask("getCameraFOVRad", "fov"));
    CHECK_THAT(number_of(fov[0]), WithinRel(40 * pi / 180, 1e-15));
    CHECK(client.ask("getCameraFOVDeg", "fov") == Value(List{40.0, 30.0}));
    CHECK(client.ask("getImageSize", "size") == Value(List{640, 480}));
}

TEST_CASE("compression changes no byte", "[serve]") {
    Client client;
    client.sun(6.957e8, {1, 1, au_m}, pi * au_m * au_m);
    client.ball("ball", 1, {0.3, 0, -8});
    client.size(48, 32);
    client.samples(4);
    client.call("enableLOSmapping", {{"b_enable", true}});
    client.call("enableTimeMapping", {{"b_enable", true}});
    client.call("setIntegrationTime", {{"integration_time", 0.5}});
    client.call("render");
    for (const char* name : {"getImage", "getImageRGBA8", "getImageGray32F", "getImageGray8", "getDepthMap",
                             "getNormalMap", "getLOSMap", "getTimeMap"}) {
        INFO(name);
        client.call("setCompressionLevel", {{"compression_level", 0}});
        const auto plain = client.numbers<std::uint8_t>(name);
        CHECK(plain.size() >= std::size_t{48} * 32);
        for (const std::int32_t level : {1, 3, 9}) {
            client.call("setCompressionLevel", {{"compression_level", level}});
            CHECK(client.numbers<std::uint8_t>(name) == plain);
        }
    }
    // Compressed, floats come as planes of their bytes.
    const Fields spectrum{{"spectrum", List{1.0, 2.0, 0.0, 0.5}}};
    client.call("setCompressionLevel", {{"compression_level", 0}});
    const auto plain = client.numbers<std::uint8_t>("getImageSpectrumProjection", spectrum);
    client.call("setCompressionLevel", {{"compression_level", 3}});
    const auto planes = client.numbers<std::uint8_t>("getImageSpectrumProjection", spectrum);
    REQUIRE(planes.size() == plain.size());
    bool same = true;
    for (std::size_t i = 0; i < plain.size(); ++i)
        same = same && plain[i] == planes[i % 4 * (plain.size() / 4) + i / 4];
    CHECK(same);
}

TEST_CASE("depth, normals and lines of sight agree with the sphere", "[serve]") {
    Client client;
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 2, {0, 0, -10});
    client.size(32, 24);
    client.fov_deg(40, 30);
    client.call("enableLOSmapping", {{"b_enable", true}});
    for (const std::int32_t convention : {0, 1}) {
        client.call("setConventions", {{"quaternion_convention", 0}, {"camera_convention", convention}});
        client.samples(1);
        client.call("render");
        const std::vector<double> depth = client.numbers<double>("getDepthMap");
        const std::vector<float> normal = client.numbers("getNormalMap"), los = client.numbers("getLOSMap");
        const double sign = convention == 0 ? -1 : 1;
        int seen = 0;
        for (std::size_t i = 0; i < depth.size(); ++i) {
            const auto at = [&](const std::vector<float>& v) {
                return Vec3{static_cast<double>(v[3 * i]), static_cast<double>(v[3 * i + 1]),
                            static_cast<double>(v[3 * i + 2])};
            };
            CHECK_THAT(length(at(los)), WithinAbs(1, 1e-6));
            if (std::isinf(depth[i])) {
                CHECK(at(normal) == Vec3{});
                continue;
            }
            ++seen;
            // From the sphere's centre to the point, in the camera's frame.
            const Vec3 out = (at(los) * depth[i] - Vec3{0, 0, 10 * sign}) / 2;
            CHECK_THAT(length(out), WithinAbs(1, 1e-5));
            CHECK_THAT(length(out - at(normal)), WithinAbs(0, 1e-5));
        }
        CHECK(seen > 50);
    }
    // Up is +y of a camera that looks along -z: of the bottom row, which comes first, y is negative.
    client.call("setConventions", {{"quaternion_convention", 0}, {"camera_convention", 0}});
    const std::vector<float> los = client.numbers("getLOSMap");
    CHECK(los[1] < 0);
    CHECK(los[0] < 0);
    CHECK(los[2] < 0);
}

TEST_CASE("a camera that is turned looks where its attitude says", "[serve]") {
    Client client;
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 1, {20, 0, 0});
    client.size(65, 65);
    const double s = std::sqrt(0.5);
    client.turn("camera", {0.0, -s, 0.0, s}); // -90 degrees about y: -z becomes +x
    client.call("render");
    const std::vector<double> depth = client.numbers<double>("getDepthMap");
    CHECK_THAT(*std::min_element(depth.begin(), depth.end()), WithinAbs(19, 1e-3));
    CHECK_THAT(number_of(numbers_of(client.ask(
                   "intersectScene", "distance_to_hit",
                   {{"rays", List{List{0, 0, 0, 1, 0, 0}, List{List{0, 0, 0}, List{0, 1, 0}}}}}))[0]),
               WithinAbs(19, 1e-9));
}

TEST_CASE("a depth map is that of its picture, whatever has moved since", "[serve]") {
    Client client;
    client.ball("ball", 1, {0, 0, -10});
    client.size(17, 17);
    client.call("render");
    client.place("ball", {0, 0, -100});
    (void)client.ask("intersectScene", "distance_to_hit", {{"rays", List{List{0, 0, 0, 0, 0, -1}}}});
    const std::vector<double> depth = client.numbers<double>("getDepthMap");
    CHECK_THAT(*std::min_element(depth.begin(), depth.end()), WithinAbs(9, 1e-6));
    client.call("render");
    const std::vector<double> moved = client.numbers<double>("getDepthMap");
    CHECK_THAT(*std::min_element(moved.begin(), moved.end()), WithinAbs(99, 1e-6));
}

TEST_CASE("stars of a map are where its vectors say, above the threshold", "[serve]") {
    Client client;
    std::ofstream(client.folder.path() / "map.txt")
        << "2\n0.1 0.05 -1  1e-9 2e-9 3e-9 4e-9\n0 0 -2 1e-12 0 0 0\n";
    client.size(200, 100);
    client.fov_deg(40, 20);
    client.irradiance(true);
    client.call("setBackground", {{"background", "map.txt"}});
    client.call("loadPSFModel", {{"filename", "gaussian.psf"}, {"parameters", Fields{{"sigma", 0.8}}}});
    client.call("setStarThreshold", {{"threshold", 1e-11}});
    client.call("render");
    const Light light = light_of(client.numbers("getImageGray32F"), 200);
    const double fx = 100 / std::tan(20 * pi / 180), fy = 50 / std::tan(10 * pi / 180);
    CHECK_THAT(light.column, WithinAbs(100 + fx * 0.1, 0.02));
    CHECK_THAT(light.row, WithinAbs(50 - fy * 0.05, 0.02));
    CHECK_THAT(light.sum, WithinRel(2e-9, 1e-3));
    client.call("setStarThreshold", {{"threshold", 0.0}});
    client.call("render");
    CHECK_THAT(light_of(client.numbers("getImageGray32F"), 200).sum, WithinRel(2e-9 + 1e-12 / 3, 1e-5));
    std::ofstream(client.folder.path() / "short.txt") << "2\n0 0 1 1 1 1 1\n";
    client.refuse("setBackground", {{"background", "short.txt"}}, "star 2 of 2");
}

TEST_CASE("a PSF image spreads each star, and none gives it to one pixel", "[serve]") {
    Client client;
    std::ofstream(client.folder.path() / "map.txt") << "1\n0.001 0.001 -1 1 1 1 1\n";
    client.size(33, 33);
    client.irradiance(true);
    client.call("setBackground", {{"background", "map.txt"}});
    const auto psf = [&](std::int32_t w, std::int32_t h, const std::vector<float>& weights, double support) {
        std::string data(weights.size() * sizeof(float), '\0');
        std::memcpy(data.data(), weights.data(), data.size());
        return Fields{{"w", w},
                      {"h", h},
                      {"psf", Bytes{data}},
                      {"support_w", support},
                      {"support_h", support},
                      {"blooming_threshold_distance", 0}};
    };
    client.call("setPSF", psf(5, 5, std::vector<float>(25, 1.0F), 5));
    client.call("render");
    const std::vector<float> wide = client.numbers("getImageGray32F");
    CHECK_THAT(light_of(wide, 33).sum, WithinRel(1.0, 1e-3));
    CHECK_THAT(static_cast<double>(*std::max_element(wide.begin(), wide.end())), WithinRel(1 / 25.0, 0.2));
    CHECK(client.ask("getPSF", "width") == Value(5));
    client.call("setPSF", psf(0, 0, {}, -1));
    client.call("render");
    const std::vector<float> sharp = client.numbers("getImageGray32F");
    CHECK_THAT(static_cast<double>(*std::max_element(sharp.begin(), sharp.end())), WithinRel(1.0, 1e-5));
    // One weight is a point, whatever it covers; a line of three keeps its columns.
    for (const double support : {-1.0, 1.0, 7.0}) {
        client.call("setPSF", psf(1, 1, {0.25F}, support));
        client.call("render");
        CHECK(client.numbers("getImageGray32F") == sharp);
    }
    client.call("setPSF", psf(1, 3, {1, 1, 1}, -1));
    client.call("render");
    const std::vector<float> line = client.numbers("getImageGray32F");
    double in_column = 0;
    for (std::size_t row = 0; row < 33; ++row)
        in_column += static_cast<double>(line[33 * row + 16]);
    CHECK_THAT(in_column, WithinRel(1.0, 1e-3));
    CHECK_THAT(light_of(line, 33).sum, WithinRel(1.0, 1e-3));
    // A point with a tail of a quarter of the light, spread over 5 x 5 pixels.
    Fields tailed = psf(1, 1, {1}, 1);
    std::string tail(25 * sizeof(float), '\0');
    const std::vector<float> even(25, 1.0F);
    std::memcpy(tail.data(), even.data(), tail.size());
    for (const Field& field : Fields{{"w_tail", 5},
                                     {"h_tail", 5},
                                     {"psf_tail", Bytes{tail}},
                                     {"support_w_tail", 5.0},
                                     {"support_h_tail", 5.0},
                                     {"PSF_tail_coef", 0.25}})
        tailed.push_back(field);
    client.call("setPSFWithTail", tailed);
    client.call("render");
    const std::vector<float> both = client.numbers("getImageGray32F");
    CHECK_THAT(static_cast<double>(*std::max_element(both.begin(), both.end())), WithinRel(0.76, 5e-3));
    CHECK_THAT(light_of(both, 33).sum, WithinRel(1.0, 1e-3));
    client.refuse("setPSF", psf(5, 5, {1, 2, 3}, 5), "12 bytes, allowed 100");
    client.refuse("setPSF", psf(1, 1, {-1}, 1), "negative");
    client.refuse("setPSF", psf(3, 1, {0, 0, 0}, 1), "all weights are 0");
}

TEST_CASE("motion during the integration time blurs, and the middle of it is the time of the picture",
          "[serve]") {
    Client client;
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.ball("ball", 0.2, {-1, 0, -10});
    client.size(128, 32);
    client.fov_deg(30, 7.66);
    client.samples(64);
    client.call("setIntegrationTime", {{"integration_time", 2.0}});
    client.call("setObjectMotion",
                {{"object_name", "ball"}, {"motion", List{List{1.0, 0.0, 0.0}, List{0.0, 0.0, 0.0}}}});
    client.call("enableTimeMapping", {{"b_enable", true}});
    client.call("render");
    const Light light = light_of(client.numbers("getImageGray32F"), 128);
    CHECK_THAT(light.column, WithinAbs(64, 0.3));
    CHECK(client.numbers("getTimeMap").at(0) == 1.0F);
    const std::vector<double> depth = client.numbers<double>("getDepthMap");
    CHECK_THAT(depth[16 * 128 + 64], WithinAbs(9.8, 0.02)); // in the middle, where it is half way
}

TEST_CASE("the scene as a file renders the same bytes by the native protocol", "[serve]") {
    serve::compatible::CompatibleSettings settings;
    Client client;
    settings.root = client.folder.path();
    serve::compatible::ClientState client_state(settings, client.memory);
    Unhurried work;
    const auto run = [&](const char* name, const Fields& arguments) {
        const Command& command = *find_command(name);
        Reply reply;
        serve::compatible::Request request{command, client_state, Arguments(command, arguments), reply, work};
        serve::compatible::handlers().at(name)(request);
    };
    run("createBRDF", {{"name", "b"},
                       {"filename", "oren_nayar.brdf"},
                       {"parameters", Fields{{"albedo", List{0.2, 0.4, 0.6, 0.8}}}}});
    run("createShape", {{"name", "s"},
                        {"filename", "ellipsoid.shp"},
                        {"parameters", Fields{{"radius_x", 1}, {"radius_y", 2}, {"radius_z", 1.5}}}});
    run("createBody", {{"body_name", "body"}, {"shape_name", "s"}, {"brdf_name", "b"}, {"textures", List{}}});
    run("setObjectPosition", {{"object_name", "body"}, {"pos", List{1, 0, -12}}});
    run("setObjectPosition", {{"object_name", "sun"}, {"pos", List{au_m, 0, au_m}}});
    run("setImageSize", {{"width", 40}, {"height", 30}});
    run("setCameraFOVDeg", {{"fov_x", 40}, {"fov_y", 25}});
    run("setNbSamplesPerPixel", {{"nb_samples", 8}});
    run("render", {});

    serve::SceneCalls scene(client.folder.path());
    const serve::PictureLimits limits;
    serve::RenderCall render(scene, limits);
    const service::Calls calls = scene.calls();
    (void)service::bind(service::find_call(calls, "scene.load"),
                        {{"call", "scene.load"}, {"toml", client_state.document().text()}})
        .run(work);
    service::Answer answer = service::bind(render.call(), {{"call", "render"}, {"samples", 8}}).run(work);
    CHECK(answer.arrays.at(0).floats() == client_state.picture->values);
    CHECK(*std::max_element(client_state.picture->values.begin(), client_state.picture->values.end()) > 0.1F);
}

} // namespace compatible_pictures_test
