// SPDX-License-Identifier: Apache-2.0
// The keys of scene files: every kind of shape and material is documented and makes what its defaults say,
// and every mistake of a file is reported.
#include "config/section.hpp"
#include "core/error.hpp"
#include "ephemeris/time/epoch.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/minnaert.hpp"
#include "renderer/materials/model_material.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/scene_files/scene_section.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/shapes/disc.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <set>
#include <string>
#include <vector>

namespace scene_section_test {

using namespace obscura;

namespace {

/// What `read` complains of, without the folder's name.
std::string refusal(const test::TempFolder& folder, const std::function<void()>& read) {
    try {
        read();
    } catch (const Error& e) {
        std::string text = e.what();
        const std::string prefix = folder.path().string() + "/";
        while (text.find(prefix) != std::string::npos)
            text.erase(text.find(prefix), prefix.size());
        return text;
    }
    return "accepted";
}

std::string refusal(const test::TempFolder& folder, const std::string& scene) {
    return refusal(folder, [&] { (void)scene::load_scene(folder.write("s.toml", scene)); });
}

bool is_number(const config::Key& key) {
    return std::holds_alternative<double*>(key.target) ||
           std::holds_alternative<config::Scaled>(key.target) || std::holds_alternative<Vec3*>(key.target) ||
           std::holds_alternative<config::Numbers>(key.target) ||
           std::holds_alternative<std::uint32_t*>(key.target) ||
           std::holds_alternative<std::int32_t*>(key.target) ||
           std::holds_alternative<std::vector<double>*>(key.target);
}

void check_documented(const config::Key& key) {
    INFO(key.name);
    // A phrase, not a word.
    CHECK(std::count(key.help().begin(), key.help().end(), ' ') >= 2);
    CHECK(!value_text(key).empty());
    if (!is_number(key)) return;
    CHECK(std::isfinite(key.range().min));
    CHECK(std::isfinite(key.range().max));
    const std::array<std::string_view, 6> ends{"_m", "_mm", "_um", "_nm", "_deg", "_px"};
    for (const std::string_view end : ends)
        if (key.name.ends_with(end)) CHECK(key.unit() == end.substr(1));
}

const config::DocumentedTable* table_of(const std::vector<config::DocumentedTable>& tables,
                                        const std::string& variant) {
    const auto at =
        std::find_if(tables.begin(), tables.end(), [&](const auto& t) { return t.variant == variant; });
    return at == tables.end() ? nullptr : &*at;
}

} // namespace

TEST_CASE("every shape and material is documented with unit, range, help and default") {
    scene::Scene scene;
    const config::Section section = scene::scene_section(scene);
    const std::vector<config::DocumentedTable> tables = document(section, "");
    std::set<std::string> headings;
    for (const config::DocumentedTable& table : tables) {
        INFO(table.heading << " " << table.variant);
        headings.insert(table.heading);
        CHECK(!table.help.empty());
        for (const config::Key& key : table.keys)
            check_documented(key);
    }
    CHECK(headings == std::set<std::string>{"", "[sun]", "[stars]", "[camera]", "[[body]]", "[[body.height]]",
                                            "[[body.albedo]]", "[body.detail]", "[[lamp]]", "[[band]]",
                                            "[[stray_light]]", "[[landmark]]", "[[global]]",
                                            "[[sky_object]]"});
    const auto check_kind = [&](const std::string& variant, const scene::ParameterList& parameters) {
        INFO(variant);
        const config::DocumentedTable* table = table_of(tables, variant);
        REQUIRE(table != nullptr);
        for (const scene::Parameter& parameter : parameters) {
            const auto key = std::find_if(table->keys.begin(), table->keys.end(),
                                          [&](const config::Key& k) { return k.name == parameter.key.name; });
            REQUIRE(key != table->keys.end());
            CHECK(value_text(*key) == value_text(parameter.key));
            const std::string image = std::string(scene::quantity_of(parameter.key)) + "_texture";
            CHECK(parameter.image == std::any_of(table->keys.begin(), table->keys.end(),
                                                 [&](const config::Key& k) { return k.name == image; }));
        }
    };
    for (const auto& kind : renderer::shape_kinds()) {
        scene::Shape shape = kind.make_default();
        check_kind("shape = \"" + std::string(kind.name) + "\"", kind.parameters(shape));
    }
    for (const auto& kind : renderer::material_kinds()) {
        scene::Material material = kind.make_default();
        check_kind("material = \"" + std::string(kind.name) + "\"", kind.parameters(material));
    }
}

TEST_CASE("a scene's epoch is the instant of its time 0") {
    const test::TempFolder folder;
    const auto epoch_of = [&](const std::string& text) {
        return scene::parse_scene("epoch = \"" + text + "\"\n", "s.toml").epoch;
    };
    CHECK(epoch_of("2007-02-28T12:00:00Z") == ephemeris::Epoch{1172664033000000000});
    CHECK(epoch_of("2007-02-28T12:00:00") == ephemeris::Epoch{1172664033000000000});
    CHECK(epoch_of("2007 FEB 28 12:01:05.185383388 TDB") == ephemeris::Epoch{1172664033000000000});
    CHECK_FALSE(epoch_of("").has_value());
    CHECK_FALSE(scene::parse_scene("", "s.toml").epoch.has_value());
    CHECK(refusal(folder, "name = \"x\"\nepoch = \"2007-02-30\"\n") ==
          "s.toml:2:9: epoch: time \"2007-02-30\": character 9: day 30, allowed is 1 to 28 in FEB 2007");
}

TEST_CASE("the defaults of every material are within its ranges and rules") {
    for (const auto& kind : renderer::material_kinds()) {
        INFO(kind.name);
        if (kind.name == renderer::ModelMaterialParameters::kind) {
            // A law of users has no default.
            CHECK_THROWS_AS(renderer::make_material(kind.make_default(), "test"), ConfigError);
            continue;
        }
        CHECK(renderer::make_material(kind.make_default(), "test") != nullptr);
        CHECK(renderer::varying_parameters(kind.make_default()).size() <= renderer::max_parameters);
    }
}

TEST_CASE("descriptions made by programs are held to the same ranges as files") {
    const test::TempFolder folder;
    const auto material = [&](const scene::Material& m) {
        return refusal(folder, [&] { (void)renderer::make_material(m, "here"); });
    };
    CHECK(material(renderer::MinnaertParameters{0.1, 0.2}) == "here: exponent 0.2: allowed 0.3 to 2");
    CHECK(material(renderer::HapkeParameters{.filling_factor = 0.75}) ==
          "here: filling factor 0.75: allowed 0 to 0.74");
    CHECK(material(renderer::PhongParameters{0.7, 0.4}) ==
          "here: specular 0.4: allowed 0 to 0.30000000000000004 beside the diffuse reflectance");
    CHECK(material({}) == "here: has no material");
    const auto shape = [&](const scene::Shape& s) {
        renderer::ShapeContext context;
        context.place = "here";
        return refusal(folder, [&] { (void)renderer::make_shape(s, context); });
    };
    CHECK(shape(renderer::BoxParameters{{1, -1, 2}}) == "here: size 1 -1 2 m: allowed 1e-6 to 1e12 m");
    CHECK(shape(renderer::DiscParameters{1, 1}) ==
          "here: inner radius 1 m: allowed is less than the outer radius, 1 m");
    CHECK(shape({}) == "here: has no shape");
}

TEST_CASE("all mistakes of a scene are reported, a line each") {
    const test::TempFolder folder;
    CHECK(refusal(folder, R"([sun]
radius = 1
[camera]
width = 0
[[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
albedo = 1.5
)") == "s.toml:2:1: sun.radius: unknown key, did you mean \"radius_m\"?\n"
       "s.toml:4:9: camera.width: 0 is out of range, allowed 1 to 65536 px\n"
       "s.toml:8:10: body[0].albedo: 1.5 is out of range, allowed 0 to 1");
    CHECK(refusal(folder, R"([[body]]
shape = "disc"
radius_m = 1
inner_radius_m = 2
material = "phong"
diffuse = 0.8
specular = 0.8
joint_angle_deg = 3
)") == "s.toml:4:18: body[0].inner_radius_m: 2 m: allowed is less than the outer radius, 1 m\n"
       "s.toml:7:12: body[0].specular: 0.8: allowed 0 to 0.19999999999999996 beside the diffuse "
       "reflectance\n"
       "s.toml:8:19: body[0].joint_angle_deg: belongs to joint = \"hinge\"");
    CHECK(refusal(folder, "[[lamp]]\nbeam = \"spot\"\n") ==
          "s.toml:2:8: lamp[0].beam: \"spot\" is not known, allowed point, uniform, gaussian\n"
          "s.toml:1:1: lamp[0]: the key \"intensity_w_sr\" is missing");
}

TEST_CASE("of a body whose kind is not known only the common keys are judged") {
    const test::TempFolder folder;
    CHECK(refusal(folder, "[[body]]\nshape = \"cube\"\nsize_m = [1, 1, 1]\nspin_rate_deg_per_s = 1e9\n") ==
          "s.toml:2:9: body[0].shape: \"cube\" is not known, allowed ellipsoid, mesh, planet, terrain, "
          "procedural, "
          "polygons, "
          "box, disc, cone, model\n"
          "s.toml:4:23: body[0].spin_rate_deg_per_s: 1000000000 is out of range, allowed -36000 to 36000 "
          "deg/s");
}

TEST_CASE("a scene is read from text, with paths from the folder of its file") {
    const test::TempFolder folder;
    (void)folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    const scene::Scene s =
        scene::parse_scene("[[body]]\nshape = \"mesh\"\nfile = \"m.obj\"\nmaterial = \"mli\"\n",
                           folder.path() / "spacecraft.toml");
    CHECK(s.name == "spacecraft");
    REQUIRE(s.bodies.size() == 1);
    CHECK(s.bodies[0].shape.kind() == "mesh");
    CHECK(s.bodies[0].material.kind() == "ggx");
}

TEST_CASE("a trajectory of positions takes its attitude from the keys beside it") {
    const test::TempFolder folder;
    folder.write("t.csv", "time_s,x_m,y_m,z_m\n0,1,2,3\n10,4,5,6\n");
    const auto read = [&](const std::string& keys) {
        return scene::load_scene(folder.write("s.toml", "[camera]\ntrajectory = \"t.csv\"\n" + keys +
                                                            "[[body]]\nname = \"rock\"\nshape = "
                                                            "\"ellipsoid\"\nradii_m = [1, 1, 1]\n"
                                                            "trajectory = \"t.csv\"\norientation = [0, 1, "
                                                            "0, 0]\nalbedo = 0.5\n"));
    };
    const scene::Scene at_body = read("look_at = \"rock\"\nup = [1, 0, 0]\n");
    const scene::Motion& motion = at_body.camera.motion;
    REQUIRE(motion.samples.size() == 2);
    CHECK(motion.samples[1].pose.position_m == Vec3{4, 5, 6});
    REQUIRE(motion.aim);
    CHECK(motion.aim->body == "rock");
    CHECK(motion.aim->up == Vec3{1, 0, 0});
    REQUIRE(at_body.bodies[0].motion.samples.size() == 2);
    CHECK(at_body.bodies[0].motion.samples[1].pose == Pose{{4, 5, 6}, {0, 1, 0, 0}});

    const scene::Scene at_point = read("look_at_m = [7, 8, 9]\n");
    REQUIRE(at_point.camera.motion.aim);
    CHECK(at_point.camera.motion.aim->body.empty());
    CHECK(at_point.camera.motion.aim->point_m == Vec3{7, 8, 9});

    const scene::Scene fixed = read("boresight = [1, 0, 0]\nup = [0, 0, 1]\n");
    CHECK_FALSE(fixed.camera.motion.aim);
    for (const scene::TimedPose& sample : fixed.camera.motion.samples)
        CHECK(sample.pose.orientation == look_along({1, 0, 0}, {0, 0, 1}));
}

TEST_CASE("no key of a shape or a material is a key of every body") {
    scene::Scene scene;
    std::set<std::string, std::less<>> common;
    int kinds = 0;
    for (const config::DocumentedTable& table : config::document(scene::scene_section(scene), "")) {
        if (table.heading != "[[body]]") continue;
        for (const config::Key& key : table.keys) {
            INFO(table.variant << ": " << key.name);
            if (table.variant.empty())
                common.emplace(key.name);
            else
                CHECK_FALSE(common.contains(key.name));
        }
        kinds += table.variant.empty() ? 0 : 1;
    }
    CHECK(common.contains("altitude_m"));
    CHECK(kinds > 20);
}

} // namespace scene_section_test
