// SPDX-License-Identifier: Apache-2.0
// Scattering laws written in SuMoL against the built-in ones, and how scene files name them.
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/philox.hpp"
#include "images/writers/png.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace model_material_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr std::string_view surroundings = R"(
[sun]
position_m = [1.2e11, 0.6e11, 0.5e11]
[camera]
width = 96
height = 96
pixel_pitch_um = 10
focal_length_mm = 45
aperture_mm = 10
position_m = [10000, 0, 0]
boresight = [-1, 0, 0]
[[body]]
shape = "ellipsoid"
radii_m = [100, 90, 80]
)";

scene::Scene scene_with(const TempFolder& folder, std::string_view keys, std::string_view root = "") {
    return scene::load_scene(folder.write("scene.toml", fmt::format("{}{}{}\n", root, surroundings, keys)));
}
std::vector<float> picture(const scene::Scene& scene, std::uint32_t threads = 1) {
    RenderSettings options;
    options.threads = threads;
    return render_window(Renderer(scene, options), {0, 0, 96, 96});
}
std::string refusal(const TempFolder& folder, std::string_view keys, std::string_view root = "") {
    try {
        (void)Renderer(scene_with(folder, keys, root), {});
    } catch (const Error& error) {
        std::string text = error.what();
        const std::string place = folder.path().string() + "/";
        for (std::size_t at = 0; (at = text.find(place)) != std::string::npos;)
            text.erase(at, place.size());
        return text;
    }
    return "accepted";
}

/// Random directions that can be.
ScatterPacket directions(std::uint32_t seed) {
    ScatterPacket s;
    for (std::uint32_t i = 0; i < packet_size; ++i) {
        const auto words = philox4x32({i, seed, 0, 0}, philox_key(5));
        const double mu0 = uniform_double(words[0]), mu = 1e-3 + 0.999 * uniform_double(words[1]);
        s.cos_in[static_cast<int>(i)] = mu0;
        s.cos_out[static_cast<int>(i)] = mu;
        s.cos_phase[static_cast<int>(i)] =
            mu0 * mu + std::sqrt((1 - mu0 * mu0) * (1 - mu * mu)) * std::cos(6.28 * uniform_double(words[2]));
    }
    return s;
}

} // namespace

TEST_CASE("laws rewritten as models agree with the built-in ones") {
    struct Pair {
        std::string built_in, model;
        double tolerance;
    };
    // The built-in Hapke uses an exponential and an arc cosine that are good to 5e-10.
    const std::vector<Pair> pairs{
        {"material = \"lambert\"\nalbedo = 0.3", "material = { model = \"lambert\", albedo = 0.3 }", 1e-15},
        {"material = \"lommel-seeliger\"\nalbedo = 0.2",
         "material = { model = \"lommel-seeliger\", albedo = 0.2 }", 1e-12},
        {"material = \"minnaert\"\nalbedo = 0.2\nexponent = 0.6",
         "material = { model = \"minnaert\", albedo = 0.2, exponent = 0.6 }", 1e-12},
        {"material = \"oren-nayar\"\nalbedo = 0.4\nslope_deg = 25",
         "material = { model = \"oren-nayar\", albedo = 0.4, slope_deg = 25 }", 1e-12},
        {"material = \"hapke\"\nsingle_scattering_albedo = 0.33\nphase_b = 0.25\nphase_c = 0.4\nshadow_hiding_b0 = 1.8\n"
         "shadow_hiding_h = 0.07\nbackscatter_b0 = 0.6\nbackscatter_h = 0.1\nroughness_deg = 23\nfilling_factor = 0.3",
         "material = { model = \"hapke\", w = 0.33, b = 0.25, c = 0.4, shadow_hiding_b0 = 1.8, shadow_hiding_h = 0.07, "
         "backscatter_b0 = 0.6, backscatter_h = 0.1, roughness_deg = 23, filling_factor = 0.3 }",
         1e-8},
    };
    const TempFolder folder;
    for (const Pair& pair : pairs) {
        INFO(pair.built_in);
        const scene::Scene built_in = scene_with(folder, pair.built_in),
                           model = scene_with(folder, pair.model);
        const auto a = make_material(built_in.bodies[0].material, "built-in");
        const auto b = make_material(model.bodies[0].material, "model");
        double most = 0;
        for (std::uint32_t seed = 0; seed < 500; ++seed) {
            const ScatterPacket s = directions(seed);
            Doubles expected, given;
            a->reflectance(s, expected);
            b->reflectance(s, given);
            for (int i = 0; i < packet_size; ++i)
                most = std::max(most, std::abs(given[i] - expected[i]) / std::max(expected[i], 1e-9));
        }
        CHECK(most < pair.tolerance);
        const std::vector<float> pa = picture(built_in), pb = picture(model);
        double difference = 0, largest = 0;
        for (std::size_t i = 0; i < pa.size(); ++i) {
            difference = std::max(difference, static_cast<double>(std::abs(pa[i] - pb[i])));
            largest = std::max(largest, static_cast<double>(pa[i]));
        }
        CHECK(largest > 0);
        CHECK(difference <= 1e-6 * largest);
    }
}

TEST_CASE("a picture with a model is the same on any number of threads") {
    const TempFolder folder;
    const scene::Scene scene = scene_with(folder, "material = { model = \"akimov\" }");
    const std::vector<float> one = picture(scene, 1);
    CHECK(picture(scene, 2) == one);
    CHECK(picture(scene, 7) == one);
}

TEST_CASE("an image gives a parameter of a model, or its texture") {
    const TempFolder folder;
    const std::vector<std::uint16_t> texels{0, 0, 13107, 65535, 65535, 40000, 0, 0};
    images::write_png16(folder.path() / "map.png", 8, 1, 16, texels, {});
    folder.write(
        "mapped.brdf",
        "parameter albedo 0.2;\nparameter texture exponent;\n"
        "vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess, scalar t,\n"
        "          scalar duration, vec3 uv, scalar lod_bias)\n"
        "{ scalar k = lookup3DLOD(exponent, uv, lod_bias).x;\n"
        "  return diffuse * (albedo * M_1_PI) * (i|n) * pow((i|n) * (e|n), k - 1); }");
    const std::vector<float> built_in = picture(scene_with(
        folder,
        "material = \"minnaert\"\nalbedo = 0.2\nexponent_texture = \"map.png\"\nexponent_texture_range = [0.4, 1.2]"));
    const std::vector<float> number = picture(scene_with(
        folder,
        "material = { model = \"minnaert\", albedo = 0.2, exponent_texture = \"map.png\", exponent_texture_range = [0.4, 1.2] }"));
    const std::vector<float> texture = picture(scene_with(
        folder,
        "material = { model = \"mapped.brdf\", albedo = 0.2, exponent = \"map.png\", exponent_range = [0.4, 1.2] }"));
    const float largest = *std::max_element(built_in.begin(), built_in.end());
    for (std::size_t i = 0; i < built_in.size(); ++i) {
        CHECK(std::abs(number[i] - built_in[i]) <= 1e-6F * largest);
        CHECK(std::abs(texture[i] - built_in[i]) <= 1e-6F * largest);
    }
}

TEST_CASE("mistakes in the table of a model are told at their places") {
    const TempFolder folder;
    folder.write("bad.brdf", "vec4 brdf(vec3 i) { return vec4(x); }");
    folder.write(
        "nan.brdf",
        "vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh) { return d * sqrt((i|n) - 0.5); }");
    folder.write(
        "bright.brdf",
        "vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh) { return d * 1.2 * (i|n) / M_PI; }");
    folder.write(
        "square.brdf",
        "vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh) { return 0.1 * d * d * (i|n); }");
    folder.write(
        "map.brdf",
        "parameter texture map; vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh) { return d; }");
    CHECK(
        refusal(folder, "material = \"model\"") ==
        "scene.toml:15:12: body[0].material: a law of your own has a table: write material = { model = \"FILE.brdf\" }");
    CHECK(refusal(folder, "material = { albedo = 1 }") ==
          "scene.toml:15:12: body[0].material: the key \"model\" is missing");
    CHECK(
        refusal(folder, "material = { model = \"akimow\" }") ==
        "scene.toml:15:22: body[0].material.model: akimow: no such file, and no shipped material model: there are akimov, "
        "cook-torrance, hapke, kaasalainen-shkuratov, lambert, lommel-seeliger, measured-phase, minnaert, oren-nayar; did you "
        "mean \"akimov\"?");
    CHECK(
        refusal(
            folder,
            "material = { model = \"akimov\", normal_albedo = 2, phase_slop = 1, phase_slope_texture = \"x.png\" }") ==
        "scene.toml:15:48: body[0].material.normal_albedo: 2 is out of range, allowed 0 to 1\n"
        "scene.toml:15:51: body[0].material.phase_slop: unknown key, did you mean \"phase_slope\"?\n"
        "scene.toml:15:89: body[0].material.phase_slope_texture: x.png: no such file");
    CHECK(
        refusal(folder, "material = { model = \"bad.brdf\" }") ==
        "bad.brdf:1:6: 'brdf' must be vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 diffuse, vec4 specular, scalar shininess [, scalar "
        "t, scalar duration [, vec3 uv, scalar lod_bias]])\nbad.brdf:1:33: 'x' is not declared");
    CHECK_THAT(refusal(folder, "material = { model = \"nan.brdf\" }"),
               ContainsSubstring(
                   "nan.brdf: brdf() is not finite for 25.0 % of lit and seen directions, at incidence "));
    CHECK_THAT(
        refusal(folder, "material = { model = \"bright.brdf\" }", "max_bounces = 2\n"),
        ContainsSubstring("bright.brdf: brdf() reflects 1.2 of the light that comes in at incidence "));
    CHECK(refusal(folder, "material = { model = \"bright.brdf\" }") == "accepted");
    CHECK_THAT(refusal(folder, "material = { model = \"square.brdf\" }\ncolour = [0.5]"),
               ContainsSubstring("brdf() is not proportional to `diffuse`"));
    CHECK(refusal(folder, "material = { model = \"square.brdf\" }") == "accepted");
    CHECK_THAT(refusal(folder, "material = { model = \"map.brdf\" }"),
               ContainsSubstring("the image of the model's texture \"map\" is missing"));
}

TEST_CASE("a law that is not physical gives one warning") {
    const TempFolder folder;
    folder.write("odd.brdf", "vec4 brdf(vec3 i, vec3 e, vec3 n, vec4 d, vec4 s, scalar sh)\n"
                             "{ return d * 1.3 * (0.9 - (e|n)) * (i|n); }");
    const std::vector<std::string> lines =
        model_material_warnings(scene_with(folder, "material = { model = \"odd.brdf\" }\nname = \"rock\""));
    REQUIRE(lines.size() == 2);
    // (e|n) > 0.9 for 19 % of cosine-weighted directions.
    CHECK_THAT(lines[0],
               ContainsSubstring(
                   "odd.brdf: brdf() is negative for 20.8 % of lit and seen directions, most at incidence "));
    CHECK_THAT(lines[1],
               ContainsSubstring("brdf() is not reciprocal: exchanging light and camera changes it by "));
    CHECK(model_material_warnings(scene_with(folder, "material = { model = \"hapke\" }")).empty());
}

TEST_CASE("shipped models need no warning") {
    for (const auto& file : config::shipped_files(models::shipped_models("material"))) {
        INFO(file);
        const TempFolder folder;
        const scene::Scene scene =
            scene_with(folder, fmt::format("material = {{ model = \"{}\" }}", file.stem().string()));
        CHECK(model_material_warnings(scene).empty());
        CHECK(picture(scene).size() == 96 * 96);
    }
}

} // namespace model_material_test
