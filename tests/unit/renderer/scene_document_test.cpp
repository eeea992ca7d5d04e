// SPDX-License-Identifier: Apache-2.0
// A scene built key by key is the scene of a file with these keys.
#include "config/document.hpp"
#include "core/error.hpp"
#include "renderer/scene_files/scene_document.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <string>
#include <vector>

namespace scene_document_test {

using namespace obscura;
using namespace obscura::scene;
using Catch::Matchers::ContainsSubstring;
using Item = SceneDocument::Item;

namespace {

config::Value table(const std::string& text) {
    return config::parse_text(text, "test");
}

std::vector<SceneDocument::Change> changes(const std::string& text) {
    std::vector<SceneDocument::Change> all;
    for (const config::Member& member : table(text).members)
        all.push_back({member.key, member.value});
    return all;
}

const Item ball{std::string("ball")};

SceneDocument two_bodies() {
    SceneDocument document;
    document.add("body", table("name = 'ball'\nshape = 'ellipsoid'\nradii_m = [1, 2, 3]\nalbedo = 0.5"));
    document.add("body", table("name = 'box'\nshape = 'box'\nsize_m = [1, 1, 1]\nalbedo = 0.2"));
    return document;
}

} // namespace

TEST_CASE("calls build the scene that its exported file has", "[renderer]") {
    SceneDocument document = two_bodies();
    document.set("camera", nullptr,
                 changes("width = 64\nheight = 32\nposition_m = [0, 0, -10.25]\nlook_at = 'ball'"));
    document.set("scene", nullptr, changes("light_time = true\nname = 'test'"));
    document.set("body", &ball, changes("position_m = [0.1, 0, 0]"));
    const Scene read = parse_scene(document.text(), "exported.toml");
    CHECK(read.name == "test");
    CHECK(read.light_time);
    CHECK(read.camera.width == 64);
    CHECK(read.camera.motion.samples[0].pose.position_m == Vec3{0, 0, -10.25});
    REQUIRE(read.bodies.size() == 2);
    CHECK(read.bodies[0].name == "ball");
    CHECK(read.bodies[0].motion.samples[0].pose.position_m == Vec3{0.1, 0, 0});
    CHECK(read.bodies[0].shape.get<renderer::EllipsoidParameters>().radii_m == Vec3{1, 2, 3});
}

TEST_CASE("a wrong change is refused as a whole", "[renderer]") {
    SceneDocument document = two_bodies();
    const std::string before = document.text();
    const auto revision = document.revision();
    CHECK_THROWS_WITH(document.set("body", &ball, changes("position_m = [1, 2, 3]\nalbedo = 2")),
                      ContainsSubstring("body[0].albedo: 2 is out of range, allowed 0 to 1"));
    CHECK_THROWS_WITH(document.set("camera", nullptr, changes("widht = 3")),
                      ContainsSubstring("camera.widht: unknown key, did you mean \"width\"?"));
    CHECK_THROWS_WITH(document.set("body", nullptr, {}), ContainsSubstring("which [[body]]?"));
    const Item bal{std::string("bal")}, third{std::size_t{2}}, first{std::size_t{0}};
    CHECK_THROWS_WITH(document.set("body", &bal, {}), ContainsSubstring("did you mean \"ball\"?"));
    CHECK_THROWS_WITH(document.set("body", &third, {}), ContainsSubstring("no element 2, there are 2"));
    CHECK_THROWS_WITH(document.set("camera", &first, {}), ContainsSubstring("there is only one"));
    CHECK_THROWS_WITH(document.set("bodys", &first, {}), ContainsSubstring("did you mean \"body\"?"));
    CHECK_THROWS_WITH(document.add("camera", table("")), ContainsSubstring("there is only one"));
    CHECK_THROWS_WITH(document.add("body", table("name = 'x'")), ContainsSubstring("\"shape\" is missing"));
    CHECK_THROWS_AS(document.remove("scene", nullptr), ConfigError);
    CHECK(document.text() == before);
    CHECK(document.revision() == revision);
}

TEST_CASE("keys and elements are removed", "[renderer]") {
    SceneDocument document = two_bodies();
    document.set("body", &ball, changes("position_m = [1, 2, 3]"));
    document.set("body", &ball, {{"position_m", {}}});
    CHECK(document.get("body", &ball).find("position_m") == nullptr);
    CHECK(document.scene().bodies[0].motion.samples[0].pose.position_m == Vec3{});
    document.remove("body", &ball);
    REQUIRE(document.scene().bodies.size() == 1);
    CHECK(document.scene().bodies[0].name == "box");
    const Item last{std::size_t{0}};
    document.remove("body", &last);
    CHECK(document.scene().bodies.empty());
    document.set("camera", nullptr, changes("width = 64"));
    document.remove("camera", nullptr);
    CHECK(document.scene().camera.width == Camera{}.width);
    CHECK(document.text().empty());
}

TEST_CASE("what a table gives can be asked", "[renderer]") {
    SceneDocument document = two_bodies();
    document.set("scene", nullptr, changes("max_bounces = 3"));
    CHECK(document.get("body", &ball).find("albedo")->value.real == 0.5);
    CHECK(document.get("body", nullptr).items.size() == 2);
    const config::Value root = document.get("scene", nullptr);
    CHECK(root.members.size() == 1);
    CHECK(root.find("max_bounces")->value.integer == 3);
    CHECK(document.get("sun", nullptr).members.empty());
}

TEST_CASE("names of files are visited, and absolute in the exported file", "[renderer]") {
    const test::TempFolder folder;
    (void)folder.write("data/p.csv", "time_s,x_m,y_m,z_m,qw,qx,qy,qz\n0,0,0,-9,1,0,0,0\n9,0,1,-9,1,0,0,0\n");
    const auto file = folder.path() / "scene.toml";
    const SceneDocument document(table("name = 'data/p.csv'\n[camera]\ntrajectory = 'data/p.csv'\n"
                                       "[stars]\ncatalogue = 'bright'"),
                                 file);
    const Scene read = parse_scene(document.text(), "/elsewhere/scene.toml");
    CHECK(read.camera.motion.samples.size() == 2);
    CHECK(read.name == "data/p.csv"); // no key of files
    CHECK_THAT(document.text(), ContainsSubstring("catalogue = \"bright\""));

    config::Value root =
        table("kernels = ['a', 'b']\n[[body]]\nshape = 'mesh'\nfile = 'm.obj'\nname = 'n'\n"
              "albedo_texture = 't.png'\n[[body.albedo]]\nfile = 'x.png'\n[[body.height]]\nfile = 'h'");
    std::vector<std::string> seen;
    visit_files(root, file, [&](const config::Value& value, const std::filesystem::path& from) {
        CHECK(from == folder.path());
        seen.push_back(value.string);
    });
    CHECK(seen.size() == 6);
}

} // namespace scene_document_test
