// SPDX-License-Identifier: Apache-2.0
// Shapes are taken over from the scene before where they are the same, and pictures do not depend on that.
#include "renderer/renderer.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/shape_cache.hpp"
#include "renderer/shapes/shape_context.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

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
        std::vector<std::shared_ptr<const Shape>> shapes;
        cache.begin_scene();
        for (const std::string& body : keys)
            shapes.push_back(cache.get(shape_of(folder, body), context));
        cache.end_scene();
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
        cache.begin_scene();
        auto shape = cache.get(shape_of(folder, mesh), context);
        cache.end_scene();
        return shape;
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

TEST_CASE("terrains are made anew", "[renderer]") {
    const test::TempFolder folder;
    ShapeCache cache;
    const scene::Shape planet = shape_of(folder, "shape = 'planet'\nradii_m = [1000, 1000, 1000]\n");
    ShapeContext first, second;
    cache.begin_scene();
    CHECK(cache.get(planet, first) != cache.get(planet, second));
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
