// SPDX-License-Identifier: Apache-2.0
// Shapes written in SuMoL against built-in ones: rays, pictures, shadows, and how scene files name them.
#include "config/shipped_files.hpp"
#include "core/philox.hpp"
#include "models/values/model_use.hpp"
#include "renderer/packets/detail_view.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/registries/shape_cache.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/model_shape.hpp"
#include "renderer/world/model_warnings.hpp"
#include "scene_texts.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace model_shape_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr std::string_view ball = "parameter radius 100; //! m, 1..1e9, Radius\n"
                                  "scalar bound_radius() { return 1.1 * radius; }\n"
                                  "scalar outside(vec3 p) { return length(p) - radius; }\n";

std::shared_ptr<const Shape> model_shape(const std::string& text) {
    return std::make_shared<ModelShape>(ModelShapeParameters{
        models::defaults_of(models::loaded_model(models::Model::parse("body.shp", text), {}))});
}

Vec3 random_direction(std::uint32_t i, std::uint32_t k) {
    const auto w = philox4x32({i, k, 0, 0}, philox_key(41));
    const double z = 2 * uniform_double(w[0]) - 1, a = 2 * std::numbers::pi * uniform_double(w[1]);
    return {std::sqrt(1 - z * z) * std::cos(a), std::sqrt(1 - z * z) * std::sin(a), z};
}

/// Rays from `distance` to points within `reach` of the origin.
RayPacket rays_to(std::uint32_t packet, double distance, double reach) {
    RayPacket rays;
    for (int i = 0; i < packet_size; ++i) {
        const auto n = packet * packet_size + static_cast<std::uint32_t>(i);
        const Vec3 from = distance * random_direction(n, 0);
        const double share = uniform_double(philox4x32({n, 2, 0, 0}, philox_key(41))[0]);
        rays.origin.set(i, from);
        rays.direction.set(i, normalized(reach * share * random_direction(n, 1) - from));
        rays.t_max[i] = no_hit;
        rays.active.on[i] = -1;
    }
    return rays;
}

/// The camera is 1 % of the radius over the surface, or far away; the body turns and moves.
std::string scene_text(std::string_view shape, std::string_view camera, std::string_view more = "") {
    return fmt::format(R"(
[sun]
position_m = [1.2e11, 0.6e11, 0.5e11]
[camera]
width = 96
height = 80
pixel_pitch_um = 10
aperture_mm = 1
up = [0, 0, 1]
{}
[[body]]
name = "ball"
shape = {}
albedo = 0.3
spin_axis = [0.3, 0.2, 1]
spin_rate_deg_per_s = 40
{}
)",
                       camera, shape, more);
}
constexpr std::string_view far = "focal_length_mm = 3\nposition_m = [760, 60, 30]\nlook_at_m = [0, 0, 0]";
constexpr std::string_view near = "focal_length_mm = 1\nposition_m = [101, 0, 0]\nlook_at_m = [90, 40, 20]";

std::vector<float> picture(const scene::Scene& scene, std::uint32_t threads = 2) {
    RenderSettings options;
    options.threads = threads;
    options.samples_per_pixel = 8;
    options.max_bounces = 1;
    return render_window(Renderer(scene, options), {0, 0, 96, 80}, 80, 1, Time{125'000'000}, 10'000'000);
}

} // namespace

TEST_CASE("a sphere in SuMoL is hit where the built-in one is") {
    const auto own = model_shape(std::string(ball));
    const Ellipsoid sphere(EllipsoidParameters{{100, 100, 100}});
    for (const double distance : {101.0, 400.0, 1e6}) {
        int holes = 0, doubtful = 0;
        double worst_t = 0, worst_normal = 0;
        DetailCounts counts;
        DetailView view;
        view.counts = &counts;
        for (std::uint32_t packet = 0; packet < 6000; ++packet) {
            RayPacket rays = rays_to(packet, distance, 101);
            rays.detail = &view;
            HitPacket a, b;
            a.clear();
            b.clear();
            own->intersect(rays, 0, a);
            sphere.intersect(rays, 0, b);
            SurfacePacket at, wanted;
            own->surface(rays, a, 0, at);
            sphere.surface(rays, b, 0, wanted);
            for (int i = 0; i < packet_size; ++i) {
                const Vec3 o = rays.origin.lane(i), d = rays.direction.lane(i);
                const double miss = std::abs(length(o - dot(o, d) * d) - 100);
                if (miss < 1e-8) continue; // one of the two may be past the limb
                if ((a.body[i] == 0) != (b.body[i] == 0)) ++holes;
                if (a.body[i] != 0 || b.body[i] != 0) continue;
                worst_t = std::max(worst_t, std::abs(a.t[i] - b.t[i]));
                worst_normal = std::max(worst_normal, length(at.normal.lane(i) - wanted.normal.lane(i)));
                doubtful += at.outside.on[i] == -1 ? 0 : 1;
            }
        }
        CHECK(holes == 0);
        CHECK(doubtful == 0);
        CHECK(counts.doubtful == 0);
        CHECK(worst_t < 1e-9 * 100);
        CHECK(worst_normal < 1e-7);
    }
}

TEST_CASE("a picture of a sphere in SuMoL is that of the built-in one") {
    const SceneTexts folder;
    folder.write("ball.shp", std::string(ball));
    for (const std::string_view camera : {far, near}) {
        const auto own = picture(folder.scene(scene_text("{ model = \"ball.shp\", radius = 100 }", camera)));
        const auto built_in =
            picture(folder.scene(scene_text("\"ellipsoid\"\nradii_m = [100, 100, 100]", camera)));
        const float brightest = *std::max_element(built_in.begin(), built_in.end());
        REQUIRE(brightest > 0);
        float worst = 0;
        for (std::size_t i = 0; i < own.size(); ++i)
            worst = std::max(worst, std::abs(own[i] - built_in[i]));
        CHECK(worst / brightest <= 1e-6F);
    }
}

TEST_CASE("a picture of a shape in SuMoL is the same on any number of threads, native or not") {
    const SceneTexts folder;
    const std::string text = scene_text(
        "{ model = \"contact-binary\", radius_1 = 60, radius_2 = 45, distance = 85, neck = 20 }", far);
    const auto one = picture(folder.scene(text), 1);
    CHECK(*std::max_element(one.begin(), one.end()) > 0);
    CHECK(picture(folder.scene(text), 2) == one);
    CHECK(picture(folder.scene(text), 7) == one);
    const models::UseModels interpreted({{}, models::Execution{models::NativeTarget::none}});
    CHECK(picture(folder.scene(text), 2) == one);
}

TEST_CASE("a claim of half of the slope is counted in the frame, a sound shape is not") {
    const SceneTexts folder;
    folder.write("ball.shp", std::string(ball));
    folder.write("wrong.shp", "property lipschitz 0.5;\n" + std::string(ball));
    const auto doubtful = [&](std::string_view shape, std::string_view camera) {
        RenderSettings options;
        options.samples_per_pixel = 4;
        const Renderer renderer(folder.scene(scene_text(shape, camera)), options);
        (void)render_window(renderer, {0, 0, 96, 80}, 80, 1);
        CHECK(renderer.work().rays > 0);
        return renderer.work().rays_doubtful;
    };
    CHECK(doubtful("{ model = \"ball.shp\" }", far) == 0);
    CHECK(doubtful("{ model = \"ball.shp\" }", near) == 0);
    CHECK(doubtful("{ model = \"torus\" }", far) == 0);
    CHECK(doubtful("{ model = \"wrong.shp\" }", far) > 1000);
    const auto warnings = model_shape("property lipschitz 0.5;\n" + std::string(ball))->warnings();
    REQUIRE(warnings.size() == 1);
    CHECK_THAT(warnings[0], ContainsSubstring("body.shp: ") && ContainsSubstring("lipschitz of 0.5"));
}

TEST_CASE("a shape in SuMoL casts its shadow on itself and on others") {
    const SceneTexts folder;
    // A ring between the Sun and a ball: its shadow falls on the ball and on its own far side.
    const std::string text = R"(
[sun]
direction = [1, 0, 0]
[camera]
width = 96
height = 80
pixel_pitch_um = 10
focal_length_mm = 3
aperture_mm = 1
position_m = [250, 60, 120]
look_at_m = [0, 0, 0]
up = [0, 0, 1]
[[body]]
shape = "ellipsoid"
radii_m = [50, 50, 50]
albedo = 0.3
)";
    const auto alone = picture(folder.scene(text));
    const auto ringed = picture(folder.scene(
        text + "[[body]]\nshape = { model = \"torus\", ring_radius = 80, tube_radius = 8 }\nalbedo = 0\n"));
    int darker = 0;
    for (std::size_t i = 0; i < alone.size(); ++i)
        if (alone[i] > 0 && ringed[i] < 0.1F * alone[i]) ++darker;
    CHECK(darker > 100);
}

TEST_CASE("a body smaller than a pixel has the light of the built-in one") {
    const SceneTexts folder;
    folder.write("ball.shp", std::string(ball));
    const std::string_view camera =
        "focal_length_mm = 3\nposition_m = [9e5, 4e4, 1e4]\nlook_at_m = [0, 0, 0]";
    const auto light = [&](std::string_view shape) {
        double sum = 0;
        RenderSettings options;
        options.samples_per_pixel = 4096;
        for (const float value :
             render_window(Renderer(folder.scene(scene_text(shape, camera)), options), {0, 0, 96, 80}, 80, 1))
            sum += static_cast<double>(value);
        return sum;
    };
    const double built_in = light("\"ellipsoid\"\nradii_m = [100, 100, 100]");
    CHECK(built_in > 0);
    CHECK(light("{ model = \"ball.shp\" }") == Approx(built_in).epsilon(0.02));
}

TEST_CASE("mistakes in a shape are told with their places") {
    const SceneTexts folder;
    folder.write("ball.shp", std::string(ball));
    folder.write("hills.shp",
                 "scalar height(scalar longitude, scalar latitude) { return 3 * sin(latitude); }\n");
    folder.write("nothing.shp",
                 "scalar bound_radius() { return 2; }\nscalar outside(vec3 p) { return 1 + length(p); }\n");
    const auto said = [&](std::string_view shape) {
        const std::string text = scene_text(shape, far);
        const std::string refused = folder.refusal(text);
        if (refused != "accepted") return refused;
        try {
            const Renderer renderer(folder.scene(text), {});
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    CHECK(said("{ model = \"ball.shp\" }") == "accepted");
    CHECK(said("{ model = \"hills.shp\", radii_m = [9, 9, 9] }") == "accepted");
    CHECK_THAT(said("{ model = \"ball.shp\", radiu = 3 }"),
               ContainsSubstring("body[0].shape.radiu: ") && ContainsSubstring("did you mean \"radius\"?"));
    CHECK_THAT(said("{ model = \"ball.shp\", radius = 0.5 }"), ContainsSubstring("allowed 1 to 1e9"));
    CHECK_THAT(said("{ model = \"hills.shp\" }"), ContainsSubstring("the key \"radii_m\" is missing"));
    CHECK_THAT(said("{ model = \"lambert\" }"), ContainsSubstring("body[0].shape.model: "));
    CHECK_THAT(said("\"model\""), ContainsSubstring("write shape = { model = \"FILE.shp\" }"));
    CHECK_THAT(said("{ model = \"nothing.shp\" }"),
               ContainsSubstring("nothing.shp:2:8: outside() has no sign change"));
}

TEST_CASE("a shape follows a global of the scene, and is made once for the same text and values") {
    const SceneTexts folder;
    folder.write("ball.shp", "global swell 1;\nscalar bound_radius() { return 220; }\n"
                             "scalar outside(vec3 p) { return length(p) - 100 * swell; }\n");
    const auto width = [&](double swell) {
        const auto image =
            picture(folder.scene(scene_text("{ model = \"ball.shp\" }", far) +
                                 fmt::format("[[global]]\nname = \"swell\"\nvalues = [{}]\n", swell)));
        const float brightest = *std::max_element(image.begin(), image.end());
        return std::count_if(image.begin(), image.end(), [&](float x) { return x > 0.01F * brightest; });
    };
    CHECK(width(0.5) < width(1) / 3);
    ShapeCache cache;
    ShapeContext context;
    const auto described = [&](const std::string& text) {
        folder.write("ball.shp", text);
        return folder.scene(scene_text("{ model = \"ball.shp\" }", far)).bodies[0].shape;
    };
    const scene::Shape first = described(std::string(ball)), again = described(std::string(ball)),
                       other = described(std::string(ball) + "// changed\n");
    const auto made = cache.get(first, context);
    CHECK(cache.get(again, context) == made);
    CHECK(cache.get(other, context) != made);
}

} // namespace model_shape_test
