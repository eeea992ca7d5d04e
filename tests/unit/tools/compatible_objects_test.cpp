// SPDX-License-Identifier: Apache-2.0
// The published client's objects, models and conventions, and what it may not do.
#include "tests/unit/tools/compatible_client.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

namespace compatible_objects_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

TEST_CASE("maps that are off are empty, and there is no picture before render", "[serve]") {
    Client client;
    client.refuse("getImage", {}, "there is no picture");
    client.size(8, 8);
    client.call("render");
    CHECK(client.ask("getLOSMap", "w") == Value(0));
    CHECK(client.numbers("getTimeMap").empty());
    client.refuse("setImageSize", {{"width", 0}, {"height", 8}}, "allowed 1 to 65536");
    client.call("reset");
    client.refuse("getImage", {}, "there is no picture");
}

TEST_CASE("the conventions say how quaternions are meant, and move nothing", "[serve]") {
    Client client;
    client.ball("ball", 1, {0, 0, 0});
    CHECK(client.ask("getConventions", "conventions") == Value(List{0, 0}));
    CHECK(client.ask("getObjectAttitude", "attitude", {{"object_name", "camera"}}) ==
          Value(List{0.0, 0.0, 0.0, 1.0}));
    const double s = std::sqrt(0.5);
    client.turn("ball", {0.0, 0.0, 2 * s, 2 * s}); // any length
    client.turn("camera", {0.0, s, 0.0, s});
    client.call("setConventions", {{"quaternion_convention", 1}, {"camera_convention", 1}});
    const List ball = numbers_of(client.ask("getObjectAttitude", "attitude", {{"object_name", "ball"}}));
    const double wanted_ball[]{s, 0, 0, s};
    // The same camera, as a frame that looks along +z: turned by half a turn about x first.
    const List camera = numbers_of(client.ask("getObjectAttitude", "attitude", {{"object_name", "camera"}}));
    const double wanted_camera[]{0, s, 0, -s};
    for (std::size_t i = 0; i < 4; ++i) {
        CHECK_THAT(number_of(ball[i]), WithinAbs(wanted_ball[i], 1e-15));
        CHECK_THAT(number_of(camera[i]), WithinAbs(wanted_camera[i], 1e-15));
    }
    client.call("setConventions", {{"quaternion_convention", 0}, {"camera_convention", 0}});
    CHECK(client.ask("getObjectAttitude", "attitude", {{"object_name", "camera"}}) ==
          Value(List{0.0, number_of(camera[1]), 0.0, number_of(camera[1])}));
    client.refuse("setConventions", {{"quaternion_convention", 2}, {"camera_convention", 0}},
                  "allowed 0 to 1");
}

TEST_CASE("rays meet the nearest surface, others nothing", "[serve]") {
    Client client;
    client.place("sun", {au_m, 0, 0});
    client.ball("near", 1, {0, 0, 1e9 + 5});
    client.ball("far", 1, {0, 0, 1e9 + 50});
    const List hits = numbers_of(
        client.ask("intersectScene", "distance_to_hit",
                   {{"rays", List{List{0.0, 0.0, 1e9, 0.0, 0.0, 2.0}, List{0.0, 0.0, 1e9 + 40, 0.0, 0.0, 1.0},
                                  List{0.0, 3.0, 1e9, 0.0, 0.0, 1.0}}}}));
    REQUIRE(hits.size() == 3);
    CHECK_THAT(number_of(hits[0]), WithinAbs(4, 1e-6));
    CHECK_THAT(number_of(hits[1]), WithinAbs(9, 1e-6));
    CHECK(number_of(hits[2]) == std::numeric_limits<double>::infinity());
    client.refuse("intersectScene", {{"rays", List{List{0, 0, 0, 0, 0, 0}}}}, "direction of length 0");
    client.refuse("intersectScene", {{"rays", List{List{0, 0}}}}, "rows of origin");
}

TEST_CASE("objects keep what was set, by name and alias", "[serve]") {
    Client client;
    CHECK(client.ask("exists", "exists", {{"object_name", "camera"}}) == Value(true));
    CHECK(client.ask("exists", "exists", {{"object_name", "sun"}}) == Value(true));
    CHECK(client.ask("exists", "exists", {{"object_name", "moon"}}) == Value(false));
    client.ball("moon", 1e6, {1, 2, 3});
    client.call("setAlias", {{"object_name", "moon"}, {"alias", "luna"}});
    CHECK(client.ask("exists", "exists", {{"object_name", "luna"}}) == Value(true));
    client.place("luna", {4, 5, 6});
    CHECK(client.ask("getObjectPosition", "pos", {{"object_name", "moon"}}) == Value(List{4.0, 5.0, 6.0}));
    const List motion{List{1.0, 0.0, 0.0}, List{0.0, 0.0, 0.1}};
    client.call("setObjectMotion", {{"object_name", "moon"}, {"motion", motion}});
    CHECK(client.ask("getObjectMotion", "motion", {{"object_name", "moon"}}) == Value(motion));
    client.refuse("setObjectPosition", {{"object_name", "mars"}, {"pos", List{0, 0, 0}}},
                  "no object is called \"mars\", there are camera, moon, sun");
    client.refuse("setObjectAttitude", {{"object_name", "moon"}, {"attitude", List{0, 0, 0, 0}}}, "length 0");
    const double nan = std::numeric_limits<double>::quiet_NaN();
    client.refuse("setObjectAttitude", {{"object_name", "moon"}, {"attitude", List{nan, nan, nan, nan}}},
                  "not finite");
    client.refuse("setImageSize", {{"width", 1e9}, {"height", 1e9}}, "allowed 1 to 65536");
    client.refuse("createBody",
                  {{"body_name", "x"}, {"shape_name", "none"}, {"brdf_name", "mate"}, {"textures", List{}}},
                  "nothing is called \"none\"");
    client.call("reset");
    CHECK(client.ask("exists", "exists", {{"object_name", "moon"}}) == Value(false));
}

TEST_CASE("a light has its power, along the view of a camera of its attitude", "[serve]") {
    Client client;
    client.sun(6.957e8, {0, 0, au_m}, 0);
    client.ball("wall", 1000, {0, 0, -1010});
    client.call("createLight", {{"light_name", "lamp"},
                                {"spectrum", List{100.0, 100.0, 100.0, 100.0}},
                                {"cutoff", 30.0},
                                {"exponent", 1000.0}});
    client.size(33, 33);
    client.fov_deg(5, 5);
    client.samples(16);
    client.call("render");
    const std::vector<float> gray = client.numbers("getImageGray32F");
    const double w_sr = 100 / (2 * pi * (1 - std::cos(pi / 6)));
    CHECK_THAT(static_cast<double>(gray[16 * 33 + 16]), WithinRel(w_sr / 100 / pi, 0.01));
}

TEST_CASE("built-in models are known by their file names, others are refused", "[serve]") {
    Client client;
    for (const char* name :
         {"mate.brdf", "hapke.brdf", "oren_nayar.brdf", "phong.brdf", "raw.brdf", "sun.brdf"})
        client.call("createBRDF", {{"name", name}, {"filename", name}, {"parameters", Fields{}}});
    const Reply bare =
        client.call("createBRDF", {{"name", "m"}, {"filename", "mate.brdf"}, {"parameters", 0.12}});
    CHECK(bare.lines.size() == 1);
    const Reply more = client.call(
        "createBRDF", {{"name", "m"},
                       {"filename", "mate.brdf"},
                       {"parameters", Fields{{"albedo", List{0.1, 0.2, 0.3, 0.4}}, {"shine", 1}}}});
    REQUIRE(more.lines.size() == 1);
    CHECK_THAT(more.lines[0], ContainsSubstring("\"shine\" has no effect"));
    client.refuse("createBRDF", {{"name", "m"}, {"filename", "my.brdf"}, {"parameters", Fields{}}},
                  "mate.brdf, hapke.brdf");
    client.refuse("createBRDF",
                  {{"name", "m"}, {"filename", "mate.brdf"}, {"parameters", Fields{{"albedo", 2}}}},
                  "albedo");
    client.refuse("createShape", {{"name", "s"}, {"filename", "cube.shp"}, {"parameters", Fields{}}},
                  "sphere.shp");
    client.refuse("createMesh", {{"object_name", "m"}, {"model_name", "../x.obj"}, {"scale", 1.0}},
                  "createMesh: ");
}

TEST_CASE("a shape in SuMoL is used as it is, with its parameters", "[serve]") {
    const auto picture = [](const char* file, const Fields& parameters) {
        Client client;
        std::ofstream(client.folder.path() / "own.shp")
            << "parameter size 1; //! m, 1..1e6, Radius\nscalar bound_radius() { return 1.2 * size; }\n"
               "scalar outside(vec3 p) { return length(p) - size; }\n";
        std::ofstream(client.folder.path() / "hills.shp")
            << "parameter more 0;\nscalar height(scalar longitude, scalar latitude) { return more; }\n";
        client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
        client.call("createBRDF", {{"name", "law"}, {"filename", "mate.brdf"}, {"parameters", 0.25}});
        client.call("createShape", {{"name", "ball"}, {"filename", file}, {"parameters", parameters}});
        client.call("createBody",
                    {{"body_name", "b"}, {"shape_name", "ball"}, {"brdf_name", "law"}, {"textures", List{}}});
        client.place("b", {0, 0, -1e5});
        client.size(64, 64);
        client.fov_deg(2, 2);
        client.call("render");
        return client.numbers("getImageGray32F");
    };
    const std::vector<float> built_in = picture("sphere.shp", Fields{{"radius", 1e3}});
    const std::vector<float> own = picture("own.shp", Fields{{"size", 1e3}});
    const std::vector<float> hills =
        picture("hills.shp", Fields{{"radii_m", List{900.0, 900.0, 900.0}}, {"more", 100.0}});
    REQUIRE(own.size() == built_in.size());
    CHECK(*std::max_element(own.begin(), own.end()) > 0);
    for (std::size_t i = 0; i < own.size(); ++i) {
        CHECK(std::abs(own[i] - built_in[i]) <= 1e-6F * built_in[32 * 64 + 32]);
        CHECK(std::abs(hills[i] - built_in[i]) <= 1e-6F * built_in[32 * 64 + 32]);
    }
    Client client;
    std::ofstream(client.folder.path() / "bad.shp") << "scalar outside(vec3 p) { return q; }";
    client.refuse("createShape", {{"name", "s"}, {"filename", "bad.shp"}, {"parameters", Fields{}}},
                  "'q' is not declared");
}

TEST_CASE("a scattering law in SuMoL is used as it is, with its parameters", "[serve]") {
    const auto picture = [](const char* file, const Fields& parameters) {
        Client client;
        std::ofstream(client.folder.path() / "own.brdf")
            << "parameter level 0.5;\nparameter turn 0.1; //! deg, 0..90, not used\n"
               "vec4 brdf(vec3 $i, vec3 $e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess)\n"
               "{ return diffuse * level * max(0, (i | n)) * M_1_PI; }\n";
        client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
        client.call("createBRDF", {{"name", "law"}, {"filename", file}, {"parameters", parameters}});
        client.call("createShape",
                    {{"name", "ball"}, {"filename", "sphere.shp"}, {"parameters", Fields{{"radius", 1e3}}}});
        client.call("createBody",
                    {{"body_name", "b"}, {"shape_name", "ball"}, {"brdf_name", "law"}, {"textures", List{}}});
        client.place("b", {0, 0, -1e5});
        client.size(64, 64);
        client.fov_deg(2, 2);
        client.call("render");
        return client.numbers("getImageGray32F");
    };
    const std::vector<float> built_in = picture("mate.brdf", Fields{{"albedo", 0.25}});
    const std::vector<float> own = picture("own.brdf", Fields{{"level", 0.25}, {"turn", 0.2}});
    REQUIRE(own.size() == built_in.size());
    CHECK(*std::max_element(own.begin(), own.end()) > 0);
    for (std::size_t i = 0; i < own.size(); ++i)
        CHECK(std::abs(own[i] - built_in[i]) <= 1e-6F * built_in[32 * 64 + 32]);

    Client client;
    std::ofstream(client.folder.path() / "bad.brdf") << "vec4 brdf(vec3 i) { return vec4(x); }";
    client.refuse("createBRDF", {{"name", "m"}, {"filename", "bad.brdf"}, {"parameters", Fields{}}},
                  "'x' is not declared");
    std::ofstream(client.folder.path() / "grey.brdf")
        << "parameter c vec4(1);\nvec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh) { return d * c * (i|n) / M_PI; }";
    client.refuse(
        "createBRDF",
        {{"name", "m"}, {"filename", "grey.brdf"}, {"parameters", Fields{{"c", List{0.1, 0.2, 0.3}}}}},
        "4 numbers");
    client.call(
        "createBRDF",
        {{"name", "m"}, {"filename", "grey.brdf"}, {"parameters", Fields{{"c", List{0.1, 0.2, 0.3, 0.4}}}}});
    const Reply more = client.call(
        "createBRDF",
        {{"name", "m"}, {"filename", "grey.brdf"}, {"parameters", Fields{{"c", 0.3}, {"shine", 1}}}});
    REQUIRE(more.lines.size() == 1);
    CHECK_THAT(more.lines[0], ContainsSubstring("\"shine\" has no effect"));
}

TEST_CASE("a texture in SuMoL is used where an image is, and its globals are set", "[serve]") {
    const auto picture = [](const Fields& globals) {
        Client client;
        std::ofstream(client.folder.path() / "own.txr")
            << "parameter share 1;\nglobal gain 0.5;\n"
               "vec4 lookup2D(texture tex, vec2 uv, scalar lod) { return vec4(share * gain); }\n";
        client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
        client.call("createBRDF",
                    {{"name", "law"}, {"filename", "mate.brdf"}, {"parameters", Fields{{"albedo", 1}}}});
        client.call("createShape",
                    {{"name", "ball"}, {"filename", "sphere.shp"}, {"parameters", Fields{{"radius", 1e3}}}});
        client.call("loadTextureObject",
                    {{"name", "t"}, {"filename", "own.txr"}, {"parameters", Fields{{"share", 0.5}}}});
        client.call("createBody", {{"body_name", "b"},
                                   {"shape_name", "ball"},
                                   {"brdf_name", "law"},
                                   {"textures", List{std::string("t")}}});
        client.place("b", {0, 0, -1e5});
        client.size(64, 64);
        client.fov_deg(2, 2);
        if (!globals.empty()) client.call("setGlobalVariables", {{"names_and_values", globals}});
        client.call("render");
        return client.numbers("getImageGray32F");
    };
    const std::vector<float> own = picture({}), set = picture(Fields{{"gain", 1.0}, {"other", 3}});
    const std::size_t middle = 32 * 64 + 32;
    REQUIRE(own.size() == set.size());
    CHECK(own[middle] > 0);
    for (std::size_t i = 0; i < own.size(); ++i)
        CHECK(std::abs(set[i] - 2 * own[i]) <= 1e-6F * set[middle]);
    Client client;
    std::ofstream(client.folder.path() / "bad.txr")
        << "vec4 lookup2D(texture tex, vec2 uv, scalar lod) { return x; }";
    client.refuse("loadTextureObject", {{"name", "t"}, {"filename", "bad.txr"}, {"parameters", Fields{}}},
                  "'x' is not declared");
    client.refuse("setGlobalVariables", {{"names_and_values", Fields{{"gain", std::string("much")}}}},
                  "gain");
}

TEST_CASE("a mesh is scaled, and takes a BRDF as a whole", "[serve]") {
    Client client;
    std::ofstream(client.folder.path() / "plate.obj")
        << "v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3\nf 1 3 4\n";
    client.sun(6.957e8, {0, 0, au_m}, pi * au_m * au_m);
    client.call("createMesh", {{"object_name", "plate"}, {"model_name", "plate.obj"}, {"scale", 1e3}});
    client.call("createBRDF",
                {{"name", "gray"}, {"filename", "mate.brdf"}, {"parameters", Fields{{"albedo", 0.25}}}});
    client.call("setObjectElementBRDF",
                {{"object_name", "plate"}, {"element_name", "plate"}, {"brdf", "gray"}});
    client.refuse("setObjectElementBRDF",
                  {{"object_name", "plate"}, {"element_name", "wing"}, {"brdf", "gray"}}, "element_name");
    client.place("plate", {0, 0, -1e5});
    client.size(64, 64);
    client.fov_deg(2, 2);
    client.samples(16);
    client.call("render");
    const std::vector<float> gray = client.numbers("getImageGray32F");
    CHECK_THAT(static_cast<double>(gray[32 * 64 + 32]), WithinRel(0.25, 0.01));
    const Light light = light_of(gray, 64);
    const double f_px = 32 / std::tan(pi / 180);
    CHECK_THAT(light.sum, WithinRel(0.25 * std::pow(2e3 / 1e5 * f_px, 2), 0.02));
}

} // namespace compatible_objects_test
