// SPDX-License-Identifier: Apache-2.0
// Shapes are taken over from the scene before where they are the same, and pictures do not depend on that.
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/registries/shape_cache.hpp"
#include "renderer/renderer.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/shape_context.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace shape_cache_test {

using namespace obscura;
using namespace obscura::renderer;

namespace {

const std::string tetrahedron = "v 1 0 0\nv -1 1 0\nv -1 -1 0\nv 0 0 1\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 1 3 2\n";

scene::Shape shape_of(const test::TempFolder& folder, const std::string& keys) {
    return scene::parse_scene("[[body]]\nalbedo = 0.5\n" + keys, folder.path() / "scene.toml")
        .bodies[0]
        .shape;
}

const std::string mesh = "shape = 'mesh'\nfile = 'm.obj'\n";
const std::string rock = "shape = 'procedural'\nmean_radius_m = 10\nsubdivisions = 3\nseed = ";

std::vector<float> picture(const scene::Scene& scene, const std::shared_ptr<ShapeCache>& shapes) {
    RenderSettings settings;
    settings.shapes = shapes;
    const Renderer renderer(scene, settings);
    const std::vector<RowTime> times(32);
    RenderRequest request;
    request.window = {0, 0, 32, 32};
    request.rows = 32;
    request.row_times = times;
    std::vector<float> image(32 * 32);
    REQUIRE(renderer.render(request, image));
    return image;
}

} // namespace

TEST_CASE("a shape of an equal description is taken over", "[renderer]") {
    const test::TempFolder folder;
    (void)folder.write("m.obj", tetrahedron);
    ShapeCache cache;
    const auto scene_of = [&](const std::vector<std::string>& keys, bool emits = false) {
        ShapeContext context;
        context.emits = emits;
        std::vector<scene::Shape> descriptions;
        for (const std::string& body : keys)
            descriptions.push_back(shape_of(folder, body));
        std::vector<WantedShape> wanted;
        for (const scene::Shape& each : descriptions)
            wanted.push_back({&each, emits});
        std::vector<std::shared_ptr<const Shape>> shapes;
        cache.begin_scene(wanted);
        for (const scene::Shape& each : descriptions)
            shapes.push_back(cache.get(each, context));
        return shapes;
    };
    const auto first = scene_of({mesh, rock + "1", rock + "1"});
    CHECK(first[1] == first[2]);
    const auto second = scene_of({rock + "1", rock + "2", mesh});
    CHECK(second[0] == first[1]);
    CHECK(second[1] != first[1]);
    CHECK(second[2] == first[0]);
    CHECK(scene_of({rock + "1"}, true)[0] != first[1]); // sampled by area
    CHECK(scene_of({mesh + "metres_per_unit = 2"})[0] != first[0]);
    // What the last scene did not have is forgotten.
    const std::weak_ptr<const Shape> forgotten = scene_of({rock + "5"})[0];
    CHECK_FALSE(forgotten.expired());
    (void)scene_of({rock + "6"});
    CHECK(forgotten.expired());
}

TEST_CASE("a file that has changed is read again", "[renderer]") {
    const test::TempFolder folder;
    (void)folder.write("m.obj", tetrahedron);
    ShapeCache cache;
    const auto get = [&] {
        ShapeContext context;
        const scene::Shape description = shape_of(folder, mesh);
        cache.begin_scene({{&description, false}});
        return cache.get(description, context);
    };
    const auto first = get();
    CHECK(get() == first);
    std::filesystem::last_write_time(folder.path() / "m.obj",
                                     std::filesystem::last_write_time(folder.path() / "m.obj") +
                                         std::chrono::seconds(1));
    const auto second = get();
    CHECK(second != first);
    (void)folder.write("m.obj", tetrahedron + "# more\n");
    CHECK(get() != second);
}

TEST_CASE("a planet is taken over with its tiles, unless one of its keys is another", "[renderer]") {
    const test::TempFolder folder;
    const std::string planet = "shape = 'planet'\nradii_m = [1000, 1000, 1000]\ntile_memory_mib = 128\n";
    ShapeCache cache;
    const auto get = [&](const std::string& keys) {
        ShapeContext context;
        const scene::Shape description = shape_of(folder, keys);
        cache.begin_scene({{&description, false}});
        return cache.get(description, context);
    };
    auto first = get(planet);
    CHECK(get(planet) == first);
    CHECK(get(planet + "cell_px = 1\n") != first);
    // What is not wanted any more is gone before its successor is made: both might not fit.
    const std::weak_ptr<const Shape> forgotten = std::exchange(first, nullptr);
    CHECK(forgotten.expired());
    const auto craters =
        get(planet + "[body.detail]\ncrater_age_ga = 1\ncrater_least_m = 50\ncrater_largest_m = 300\n");
    CHECK(get(planet + "[body.detail]\ncrater_age_ga = 1\ncrater_least_m = 50\ncrater_largest_m = 300\n") ==
          craters);
    CHECK(get(planet + "[body.detail]\ncrater_age_ga = 2\ncrater_least_m = 50\ncrater_largest_m = 300\n") !=
          craters);
    // Kept sunlight depends on the pictures before.
    const auto sunlit = get(planet + "sun_visibility = 'tiles'\n");
    CHECK(get(planet + "sun_visibility = 'tiles'\n") != sunlit);
}

TEST_CASE("tiles of a planet are not made again when another body moves", "[renderer]") {
    const auto scene_at = [](double x_m) {
        scene::Scene scene = scene::parse_scene(
            "[camera]\nwidth = 32\nheight = 32\nfocal_length_mm = 40\npixel_pitch_um = 20\n"
            "position_m = [0, 0, -3000]\nboresight = [0, 0, 1]\nup = [0, -1, 0]\n"
            "[sun]\ndirection = [-1, -1, -1]\n"
            "[[body]]\nname = 'planet'\nshape = 'planet'\nradii_m = [1000, 1000, 1000]\nalbedo = 0.4\n"
            "tile_memory_mib = 128\n[body.detail]\ncrater_age_ga = 1\ncrater_least_m = 50\ncrater_largest_m "
            "= 300\n"
            "[[body]]\nname = 'moon'\nshape = 'ellipsoid'\nradii_m = [4, 4, 4]\nalbedo = 0.2\n",
            "scene.toml");
        scene.bodies[1].motion.samples[0].pose.position_m = {x_m, 0, -2000};
        return scene;
    };
    const auto cache = make_shape_cache();
    const auto tiles_made = [&] {
        ShapeContext context;
        return cache->get(scene_at(0).bodies[0].shape, context)->tiles()->usage().made;
    };
    const std::vector<float> before = picture(scene_at(0), cache);
    const std::uint64_t made = tiles_made();
    CHECK(made > 6);
    const std::vector<float> after = picture(scene_at(3), cache);
    CHECK(tiles_made() == made);
    CHECK(after != before);
    CHECK(after == picture(scene_at(3), nullptr));
    CHECK(before == picture(scene_at(0), cache));
}

TEST_CASE("a picture with shapes of the scene before is the picture without", "[renderer]") {
    const auto scene_at = [](double x_m) {
        scene::Scene scene = scene::parse_scene("[camera]\nwidth = 32\nheight = 32\nfocal_length_mm = 2\n"
                                                "pixel_pitch_um = 20\nposition_m = [0, 0, -60]\n"
                                                "boresight = [0, 0, 1]\nup = [0, -1, 0]\n"
                                                "[sun]\ndirection = [-1, -1, -1]\n[[body]]\nalbedo = 0.4\n" +
                                                    rock + "1",
                                                "scene.toml");
        scene.bodies[0].motion.samples[0].pose.position_m.x = x_m;
        return scene;
    };
    const auto shapes = make_shape_cache();
    const std::vector<float> before = picture(scene_at(0), shapes);
    const std::vector<float> after = picture(scene_at(2.5), shapes);
    CHECK(after != before);
    CHECK(after == picture(scene_at(2.5), nullptr));
    CHECK(before == picture(scene_at(0), shapes));
}

} // namespace shape_cache_test
