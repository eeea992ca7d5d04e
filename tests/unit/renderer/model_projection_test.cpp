// SPDX-License-Identifier: Apache-2.0
// Projections written in SuMoL against the built-in lens, and how scene files name them.
#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "core/philox.hpp"
#include "renderer/camera/lens.hpp"
#include "renderer/camera/model_projection.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

namespace model_projection_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;

namespace {

/// A fisheye off its middle, turned, with pixels that are not square.
constexpr std::string_view sensor = R"(
[sun]
position_m = [1.2e11, 0.6e11, 0.5e11]
[camera]
width = 160
height = 120
pixel_pitch_um = 10
pixel_pitch_y_um = 12
focal_length_mm = 0.7
aperture_mm = 1
principal_offset_px = [3.5, -2.25]
sensor_rotation_deg = 11
position_m = [260, 20, 10]
look_at_m = [0, 0, 0]
up = [0, 0, 1]
vignetting = "cos4"
)";
constexpr std::string_view bodies = R"(
[[body]]
shape = "ellipsoid"
radii_m = [100, 90, 80]
albedo = 0.3
[[body]]
shape = "ellipsoid"
name = "second"
radii_m = [30, 30, 40]
position_m = [180, 100, -20]
albedo = 0.6
[stars]
catalogue = "bright"
)";
constexpr std::string_view built_in = R"(
projection = "equidistant"
distortion = "radial"
distortion_coefficients = [-0.03, 0.004, -0.0005]
)";
constexpr std::string_view own = R"(
projection = { model = "radial", k1 = -0.03, k2 = 0.004, k3 = -0.0005, max_angle_deg = 140 }
)";

scene::Scene scene_with(const TempFolder& folder, std::string_view projection) {
    return scene::load_scene(folder.write("scene.toml", fmt::format("{}{}{}", sensor, projection, bodies)));
}
std::vector<float> picture(const scene::Scene& scene, std::uint32_t threads) {
    RenderSettings options;
    options.threads = threads;
    return render_window(Renderer(scene, options), {0, 0, 160, 120});
}
std::string refusal(const TempFolder& folder, std::string_view projection) {
    try {
        (void)Renderer(scene_with(folder, projection), {});
    } catch (const Error& error) {
        return error.what();
    }
    return "";
}

} // namespace

TEST_CASE("the model of a fisheye is the built-in lens with the same coefficients", "[renderer]") {
    const TempFolder folder;
    const scene::Camera lens_camera = scene_with(folder, built_in).camera;
    const scene::Camera model_camera = scene_with(folder, own).camera;
    const Lens lens(lens_camera);
    const ModelProjection model(model_camera);
    const double pixel = lens.pixel_angle_rad();
    for (std::uint32_t k = 0; k < 400; ++k) {
        Doubles x, y, lens_weight, model_weight;
        Vec3s lens_direction, model_direction;
        for (int i = 0; i < packet_size; ++i) {
            const auto words = philox4x32({k, static_cast<std::uint32_t>(i), 0, 0}, philox_key(5));
            x[i] = 168 * uniform_double(words[0]) - 4;
            y[i] = 128 * uniform_double(words[1]) - 4;
        }
        lens.rays(x, y, lens_direction, lens_weight);
        model.rays(x, y, model_direction, model_weight);
        for (int i = 0; i < packet_size; ++i) {
            const Vec3 d = lens_direction.lane(i);
            REQUIRE(length(d - model_direction.lane(i)) < 1e-9 * pixel);
            REQUIRE(model_weight[i] == Approx(lens_weight[i]).epsilon(1e-9));
            REQUIRE(model.solid_angle_sr(x[i], y[i]) ==
                    Approx(lens.solid_angle_sr(x[i], y[i])).epsilon(1e-9));
            REQUIRE(model.transmission(2 * d) == lens.transmission(2 * d));
            // As of a star.
            const auto a = lens.project(d), b = model.project(d);
            REQUIRE((a && b));
            REQUIRE(b->x == Approx(a->x).margin(1e-9));
            REQUIRE(b->y == Approx(a->y).margin(1e-9));
            REQUIRE(model.local_pixel_angle_rad(d) == Approx(lens.local_pixel_angle_rad(d)).epsilon(1e-6));
        }
    }
    CHECK(model.pixel_angle_rad() == Approx(lens.pixel_angle_rad()).epsilon(1e-9));
    for (const double margin : {0.0, 1.0, 20.0}) {
        CHECK(model.field_angle_rad(margin) >= lens.field_angle_rad(margin) - 0.02);
        CHECK(model.field_angle_rad(margin) <= lens.field_angle_rad(margin) + 0.1);
    }
    CHECK_FALSE(model.project({0, 0, -1}));
}

TEST_CASE("a picture through a model is that through the built-in lens, on any number of threads",
          "[renderer]") {
    const TempFolder folder;
    const scene::Scene modelled = scene_with(folder, own);
    const std::vector<float> expected = picture(scene_with(folder, built_in), 2);
    const std::vector<float> given = picture(modelled, 1);
    const float brightest = *std::max_element(expected.begin(), expected.end());
    REQUIRE(brightest > 0);
    double difference = 0;
    for (std::size_t i = 0; i < expected.size(); ++i)
        difference = std::max<double>(difference, std::fabs(given[i] - expected[i]) / brightest);
    CHECK(difference < 1e-6);
    CHECK(picture(modelled, 2) == given);
    CHECK(picture(modelled, 7) == given);
}

TEST_CASE("a projection of one's own that cannot be used is refused in one line", "[renderer]") {
    const TempFolder folder;
    folder.write("folded.prj", R"(
vec2 point(vec3 d)
{
    scalar s = max(length(d.xy), 1e-300);
    scalar t = atan2(s, d.z);
    return d.xy * (focal_length * (t - 0.3 * t * t * t) / s);
}
)");
    folder.write("nan.prj", "vec2 point(vec3 d) { return d.xy * (focal_length / 0 * 0); }\n");
    folder.write("mist.prj", "vec2 point(vec3 d) { return d.xy * focal_lenght; }\n");
    CHECK_THAT(refusal(folder, "projection = { model = \"folded.prj\" }\n"),
               ContainsSubstring("folded.prj: the projection is not one to one: directions at") &&
                   ContainsSubstring("at pixel ("));
    CHECK_THAT(refusal(folder, "projection = { model = \"nan.prj\" }\n"),
               ContainsSubstring("nan.prj: no direction falls on the sensor"));
    CHECK_THAT(
        refusal(folder, "projection = { model = \"mist.prj\" }\n"),
        ContainsSubstring("mist.prj:1:36: 'focal_lenght' is not declared; did you mean \"focal_length\"?"));
    CHECK_THAT(refusal(folder, "projection = { model = \"radial\", k5 = 1 }\n"),
               ContainsSubstring("projection.k5"));
    CHECK_THAT(refusal(folder, "projection = { model = \"radial\", k1 = 11 }\n"), ContainsSubstring("-10"));
    CHECK_THAT(refusal(folder, "projection = \"model\"\n"),
               ContainsSubstring("write projection = { model = \"FILE.prj\" }"));
    CHECK_THAT(refusal(folder, "projection = { model = \"lambert.brdf\" }\n"),
               ContainsSubstring("lambert.brdf"));
    CHECK_THAT(refusal(folder, std::string(own) + "distortion = \"radial\"\n"),
               ContainsSubstring("a projection of your own has its own distortion"));
}

TEST_CASE("a projection that sees behind the camera is told, and a mirror's field is found", "[renderer]") {
    const TempFolder folder;
    const scene::Camera camera =
        scene_with(folder, "projection = { model = \"catadioptric\", shape = 0.9, shadow_deg = 20 }\n")
            .camera;
    const ModelProjection mirror(camera);
    const double pi = 3.14159265358979;
    CHECK(mirror.field_angle_rad(0) > 100 * pi / 180);
    CHECK(mirror.transmission({0.1, 0, 1}) == 0);
    CHECK(mirror.transmission({1, 0, 0.1}) ==
          Approx(0.1 / std::sqrt(1.01)).epsilon(1e-12)); // the pupil's cosine
    // The law of the sphere: m = d.xy / (d.z + shape), in focal lengths.
    const Vec3 d = normalized(Vec3{0.8, -0.5, -0.1});
    const auto at = mirror.project(d);
    REQUIRE(at);
    const double u = 0.7e-3 * d.x / (d.z + 0.9), v = 0.7e-3 * d.y / (d.z + 0.9);
    const double turn = 11 * pi / 180;
    CHECK(at->x == Approx(79.5 + 3.5 + (u * std::cos(turn) + v * std::sin(turn)) / 10e-6).margin(1e-8));
    CHECK(at->y == Approx(59.5 - 2.25 + (v * std::cos(turn) - u * std::sin(turn)) / 12e-6).margin(1e-8));
    const std::vector<std::string> warnings = model_projection_warnings(camera);
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], ContainsSubstring("catadioptric.prj: the field reaches 1"));
    CHECK(model_projection_warnings(scene_with(folder, built_in).camera).empty());
}

} // namespace model_projection_test
