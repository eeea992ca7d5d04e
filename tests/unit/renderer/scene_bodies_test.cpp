// SPDX-License-Identifier: Apache-2.0
// What scene files say about bodies: named materials against their published albedos, textures, joints.
#include "core/error.hpp"
#include "core/solar_spectrum.hpp"
#include "renderer/materials/file_materials.hpp"
#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/materials/presets.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace scene_bodies_test {

using namespace obscura;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Geometric albedo of a sphere at phase angle 0: 2 pi times the integral of r(i = e = acos mu, g = 0) mu.
double geometric_albedo(const scene::Material& description) {
    const auto material = renderer::make_material(description, "test");
    constexpr int steps = 1600;
    double sum = 0;
    for (int n = 0; n < steps; n += renderer::packet_size) {
        renderer::ScatterPacket s;
        for (int i = 0; i < renderer::packet_size; ++i) {
            s.cos_in[i] = s.cos_out[i] = (n + i + 0.5) / steps;
            s.cos_phase[i] = 1;
        }
        renderer::Doubles r;
        material->reflectance(s, r);
        for (int i = 0; i < renderer::packet_size; ++i)
            sum += r[i] * s.cos_out[i] / steps;
    }
    return 2 * std::numbers::pi * sum;
}

std::string refusal(const test::TempFolder& folder, const std::string& text) {
    try {
        (void)scene::load_scene(folder.write("s.toml", text));
    } catch (const Error& e) {
        std::string line = e.what();
        CHECK(line.find('\n') == std::string::npos);
        const std::string prefix = folder.path().string() + "/";
        while (line.find(prefix) != std::string::npos)
            line.erase(line.find(prefix), prefix.size());
        return line;
    }
    return "accepted";
}

} // namespace

TEST_CASE("Named bodies have the geometric albedo that their sources give") {
    CHECK_THAT(geometric_albedo(renderer::LambertParameters{0.6}), WithinRel(0.4, 1e-3));
    // The model's surge goes on to phase 0, where the Moon itself is eclipsed: 0.136.
    CHECK_THAT(geometric_albedo(renderer::moon()), WithinRel(0.12, 0.15));
    CHECK_THAT(geometric_albedo(renderer::eros()), WithinRel(0.23, 0.08));
    CHECK_THAT(geometric_albedo(renderer::itokawa()), WithinRel(0.27, 0.08));
    CHECK_THAT(geometric_albedo(renderer::comet_67p()), WithinRel(0.065, 0.08));
}

TEST_CASE("Scene files name materials, textures, parents and joints") {
    const test::TempFolder folder;
    (void)folder.write("t.png", "x");
    (void)folder.write("m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    (void)folder.write("panel.csv", "time_s,angle_deg\n0,0\n10,90\n");
    const scene::Scene s = scene::load_scene(folder.write("s.toml", R"(
[[body]]
name = "bus"
shape = "box"
size_m = [1, 1, 1]
material = "mli"
roughness = 0.2
[[body]]
name = "panel"
shape = "box"
size_m = [1, 5, 0.1]
material = "solar-cell"
parent = "bus"
position_m = [0, 3, 0]
joint = "hinge"
joint_axis = [0, 1, 0]
joint_table = "panel.csv"
[[body]]
shape = "ellipsoid"
radii_m = [1, 1, 1]
material = "moon"
albedo_texture = "t.png"
texture_coding = "srgb"
texture_left_deg = 0
[[body]]
shape = "mesh"
file = "m.obj"
)"));
    CHECK(s.bodies[0].material.get<renderer::GgxParameters>().roughness == 0.2);
    CHECK(s.bodies[0].material.get<renderer::GgxParameters>().reflectance_f0 == 0.6);
    CHECK(s.bodies[1].parent == "bus");
    CHECK(s.bodies[1].joint.kind == scene::Joint::Kind::hinge);
    CHECK_THAT(s.bodies[1].joint.samples.at(1).value, WithinAbs(std::numbers::pi / 2, 1e-12));
    CHECK(s.bodies[2].material.get<renderer::HapkeParameters>().single_scattering_albedo == 0.233);
    CHECK(s.bodies[2].textures.albedo == (folder.path() / "t.png").string());
    CHECK(s.bodies[2].textures.srgb);
    CHECK(s.bodies[2].textures.left_longitude_rad == 0);
    CHECK((s.bodies[3].material.get_if<renderer::FileMaterialsParameters>() != nullptr));
}

TEST_CASE("A colour over wavelength becomes the mean of each band") {
    const test::TempFolder folder;
    const std::string body = "[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 1\n";
    const std::string bands =
        "[[band]]\nfrom_nm = 300\nto_nm = 350\n[[band]]\nfrom_nm = 450\nto_nm = 550\n[[band]]\n"
        "from_nm = 400\nto_nm = 700\n[[band]]\nfrom_nm = 800\nto_nm = 900\n";
    const scene::Scene s = scene::load_scene(
        folder.write("s.toml", body + "colour_curve = [[400, 0.1], [500, 0.5], [700, 0.3]]\n" + bands));
    // By hand: held; in between, means of the 10 nm bins of the Sun's spectrum, each with the curve's value
    // in its middle; held.
    const auto mean = [](double from_nm, double to_nm, const auto& value) {
        double lit = 0;
        double light = 0;
        for (double nm = from_nm; nm < to_nm; nm += 10) {
            const double sun = solar_band_irradiance_w_m2(nm * 1e-9, (nm + 10) * 1e-9);
            lit += sun * value(nm + 5);
            light += sun;
        }
        return lit / light;
    };
    const auto curve = [](double nm) {
        return nm < 500 ? 0.1 + 0.004 * (nm - 400) : 0.5 - 0.001 * (nm - 500);
    };
    const std::array<double, 4> wanted{0.1, mean(450, 550, curve), mean(400, 700, curve), 0.3};
    REQUIRE(s.bodies[0].colour.size() == 4);
    for (std::size_t b = 0; b < 4; ++b)
        CHECK_THAT(s.bodies[0].colour[b], WithinRel(wanted[b], 1e-6));
    // A filter weighs too: all of its light is at 600 to 610 nm.
    const scene::Scene filtered = scene::load_scene(folder.write(
        "s.toml", body +
                      "colour_curve = [[400, 0.1], [500, 0.5], [700, 0.3]]\n[[band]]\nfrom_nm = 400\nto_nm = "
                      "800\ntransmission = [[599.9, 0], [600, 1], [610, 1], [610.1, 0]]\n"));
    CHECK_THAT(filtered.bodies[0].colour[0], WithinRel(curve(605), 1e-3));
    CHECK(refusal(folder, body + "colour_curve = [[400, 0.1], [300, 0.5]]\n").find("body[0].colour_curve") !=
          std::string::npos);
    CHECK(refusal(folder, body + "colour = [1]\ncolour_curve = [[400, 0.1]]\n") ==
          "s.toml:6:16: body[0].colour_curve: cannot stand beside \"colour\"");
}

TEST_CASE("Images give parameters of materials, camera and lamps hang on bodies") {
    const test::TempFolder folder;
    (void)folder.write("t.png", "x");
    const std::string ball = "[[body]]\nname = \"ball\"\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\n";
    const scene::Scene s = scene::load_scene(folder.write("s.toml", R"(
[camera]
parent = "ball"
position_m = [0, 0, 5]
joint = "hinge"
joint_axis = [0, 1, 0]
joint_angle_deg = 90
[[lamp]]
name = "torch"
intensity_w_sr = [1]
parent = "ball"
joint = "slide"
joint_axis = [1, 0, 0]
joint_offset_m = 2
)" + ball + R"(material = "hapke"
single_scattering_albedo_texture = "t.png"
roughness_texture = "t.png"
roughness_texture_range = [10, 40]
)"));
    const auto& maps = s.bodies[0].textures.parameters;
    REQUIRE(maps.size() == 2);
    CHECK(maps[0].name == "single_scattering_albedo");
    CHECK(maps[0].file == (folder.path() / "t.png").string());
    CHECK(maps[0].at_zero == 0);
    CHECK(maps[0].at_one == 1);
    CHECK(maps[1].name == "roughness");
    CHECK_THAT(maps[1].at_zero, WithinAbs(10 * std::numbers::pi / 180, 1e-12));
    CHECK_THAT(maps[1].at_one, WithinAbs(40 * std::numbers::pi / 180, 1e-12));
    CHECK(s.camera.parent == "ball");
    CHECK(s.camera.joint.kind == scene::Joint::Kind::hinge);
    CHECK_THAT(s.camera.joint.samples.at(0).value, WithinAbs(std::numbers::pi / 2, 1e-12));
    CHECK(s.lamps[0].parent == "ball");
    CHECK(s.lamps[0].joint.samples.at(0).value == 2);

    CHECK(refusal(folder, ball + "material = \"ggx\"\nroughness = 0.2\nroughness_texture = \"t.png\"\n") ==
          "s.toml:7:21: body[0].roughness_texture: cannot stand beside \"roughness\"");
    CHECK(refusal(folder, ball + "material = \"ggx\"\nroughness_texture_range = [0, 1]\n")
              .find("the key \"roughness_texture\" is missing") != std::string::npos);
    CHECK(refusal(folder, ball + "material = \"minnaert\"\nalbedo = 0.1\nroughness_texture = \"t.png\"\n")
              .find("roughness_texture") != std::string::npos);
    CHECK(refusal(folder, ball + "albedo = 0.1\n[camera]\nparent = \"lander\"\n") ==
          "s.toml:6:2: camera: its parent 'lander' is no body of the scene");
    CHECK(refusal(folder, ball + "albedo = 0.1\n[[lamp]]\nintensity_w_sr = [1]\nparent = \"camera\"\n") ==
          "accepted");
    CHECK(refusal(folder, ball + "albedo = 0.1\n[camera]\njoint = \"hinge\"\n")
              .find("camera.joint: belongs to joint = \"fixed\" where there is no parent") !=
          std::string::npos);
}

TEST_CASE("Impossible bodies are refused with file and place") {
    const test::TempFolder folder;
    const std::string box = "[[body]]\nname = \"a\"\nshape = \"box\"\nsize_m = [1, 1, 1]\nalbedo = 0.1\n";
    CHECK(refusal(folder, box + "parent = \"a\"\n") ==
          "s.toml:1:1: body 'a': parents go in a circle: a -> a");
    CHECK(refusal(folder, box + "parent = \"b\"\n") ==
          "s.toml:1:1: body 'a': its parent 'b' is no body of the scene");
    CHECK(refusal(folder, box + "joint = \"hinge\"\n") ==
          "s.toml:6:9: body[0].joint: belongs to joint = \"fixed\" where there is no parent");
    CHECK(refusal(folder, box + "joint_angle_deg = 3\n") ==
          "s.toml:6:19: body[0].joint_angle_deg: belongs to joint = \"hinge\"");
    CHECK(refusal(folder, box + "albedo_texture = \"gone.png\"\n") ==
          "s.toml:6:18: body[0].albedo_texture: gone.png: no such file");
    (void)folder.write("bad.csv", "time_s,offset_m\n0,1\n0,2\n");
    CHECK(refusal(folder, box + box.substr(0, 9) + box.substr(20) +
                              "parent = \"a\"\njoint = \"slide\"\njoint_table = "
                              "\"bad.csv\"\n") == "bad.csv:3:1: time_s: 0 does not come after 0");
    CHECK_THAT(refusal(folder, "[[body]]\nshape = \"box\"\nsize_m = [0, 1, 1]\nalbedo = 0.1\n"),
               Catch::Matchers::ContainsSubstring("s.toml:3:") &&
                   Catch::Matchers::ContainsSubstring("size_m"));
}

TEST_CASE("Height maps are tables of planets and terrains") {
    const test::TempFolder folder;
    (void)folder.write("a.png", "");
    (void)folder.write("b.tif", "");
    const std::string planet = "[[body]]\nshape = \"planet\"\nradii_m = [2, 2, 2]\nalbedo = 0.1\n";
    const auto file =
        folder.write("good.toml", planet + "[[body.height]]\nfile = \"a.png\"\nprojection = "
                                           "\"simple_cylindrical\"\nleft_deg = 0\nright_deg = 360\n"
                                           "[[body.height]]\nfile = \"b.tif\"\npriority = 2\nmatch = "
                                           "\"offset\"\nvalues = \"radius\"\n"
                                           "[[body]]\nname = \"other\"\nshape = \"terrain\"\nhalf_edge_m = "
                                           "7\nalbedo = 0.1\n");
    const scene::Scene s = scene::load_scene(file);
    const auto& relief = s.bodies[0].shape.get<renderer::PlanetParameters>().relief;
    REQUIRE(relief.heights.size() == 2);
    CHECK(relief.heights[0].map.projection == terrain::ProjectionKind::simple_cylindrical);
    CHECK(relief.heights[0].map.right_rad == 2 * std::numbers::pi);
    CHECK(relief.heights[1].priority == 2);
    CHECK(relief.heights[1].match == terrain::PatchMatch::offset);
    CHECK(relief.heights[1].map.meaning == terrain::HeightMeaning::radius);
    CHECK(s.bodies[1].shape.get<renderer::TerrainParameters>().relief.heights.empty());

    const auto refused = [&](const std::string& rest) { return refusal(folder, planet + rest); };
    CHECK(refused("[[body.height]]\nfile = \"c.png\"\n") ==
          "s.toml:6:8: body[0].height[0].file: c.png: no such file");
    CHECK(refused("[[body.height]]\npriority = 3\n") ==
          "s.toml:5:1: body[0].height[0]: the key \"file\" is missing");
    CHECK(refused("[[body.height]]\nfile = \"a.png\"\n[[body.height]]\nfile = \"b.tif\"\nleft_deg = 3\n") ==
          "s.toml:9:12: body[0].height[1].left_deg: goes without projection = \"file\"");
    CHECK(refused("[[body.height]]\nfile = \"a.png\"\nprojection = \"south_polar_stereographic\"\n") ==
          "s.toml:5:1: body[0].height[0].pixel_m: wanted above 0 with projection = "
          "\"south_polar_stereographic\"");
    CHECK(
        refusal(folder,
                "[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nalbedo = 0.1\n[[body.height]]\nfile = "
                "\"a.png\"\n") == "s.toml:5:1: body[0].height: belongs to shape = \"planet\" or \"terrain\", "
                                  "this body's is \"ellipsoid\"");
    CHECK_THAT(refused("height = 3\n"), Catch::Matchers::ContainsSubstring("s.toml:5:"));
}

TEST_CASE("Albedo maps are tables of planets and terrains") {
    const test::TempFolder folder;
    (void)folder.write("a.png", "");
    (void)folder.write("b.tif", "");
    const std::string planet = "[[body]]\nshape = \"planet\"\nradii_m = [2, 2, 2]\n";
    const auto file = folder.write("good.toml", planet + "[[body.albedo]]\nfile = \"a.png\"\ncoding = "
                                                         "\"srgb\"\nprojection = \"simple_cylindrical\"\n"
                                                         "top_deg = 80\n[[body.albedo]]\nfile = \"b.tif\"\n"
                                                         "priority = 2\nscale = 1.5\nfeather_m = 7\n");
    const scene::Scene s = scene::load_scene(file);
    const auto& albedos = s.bodies[0].shape.get<renderer::PlanetParameters>().relief.albedos;
    REQUIRE(albedos.size() == 2);
    CHECK(albedos[0].coding == renderer::AlbedoCoding::srgb);
    CHECK(albedos[0].map.top_rad == 80 * std::numbers::pi / 180);
    CHECK(albedos[1].priority == 2);
    CHECK(albedos[1].scale == 1.5);
    CHECK(albedos[1].feather_m == 7);
    CHECK(!albedos[1].map.projection);
    // A law's own albedo is 1 under its maps; presets and normal albedos stay what they are.
    CHECK(s.bodies[0].material.get<renderer::LambertParameters>().albedo == 1);
    const auto albedo_of = [&](const std::string& more) {
        const auto with = folder.write("more.toml", planet + more + "[[body.albedo]]\nfile = \"b.tif\"\n");
        return scene::load_scene(with).bodies[0].material.get<renderer::LambertParameters>().albedo;
    };
    CHECK(albedo_of("normal_albedo = 0.25\n") == 0.25);

    const auto refused = [&](const std::string& rest) { return refusal(folder, planet + rest); };
    CHECK(refused("[[body.albedo]]\nfile = \"c.png\"\n") ==
          "s.toml:5:8: body[0].albedo[0].file: c.png: no such file");
    CHECK(refused("[[body.albedo]]\npriority = 3\n") ==
          "s.toml:4:1: body[0].albedo[0]: the key \"file\" is missing");
    CHECK(refused("[[body.albedo]]\nfile = \"a.png\"\nscale = 0\n").starts_with("s.toml:6:"));
    CHECK(refused("[[body.albedo]]\nfile = \"a.png\"\npixel_m = 3\n") ==
          "s.toml:6:11: body[0].albedo[0].pixel_m: goes without projection = \"file\"");
    CHECK_THAT(refused("albedo = 0.1\n[[body.albedo]]\nfile = \"a.png\"\n"),
               Catch::Matchers::ContainsSubstring("s.toml:5:1: not valid TOML"));
    CHECK_THAT(refusal(folder, planet + "albedo = [0.1]\n"),
               Catch::Matchers::ContainsSubstring("s.toml:4:10: body[0].albedo"));
    CHECK_THAT(refusal(folder, planet + "material = \"moon\"\nalbedo = 0.1\n"),
               Catch::Matchers::ContainsSubstring("albedo: belongs to"));
    CHECK_THAT(refusal(folder, "[[body]]\nshape = \"ellipsoid\"\nradii_m = [1, 1, 1]\nmaterial = "
                               "\"moon\"\n[[body.albedo]]\nfile = \"a.png\"\n"),
               Catch::Matchers::ContainsSubstring("belongs to shape = \"planet\" or \"terrain\""));
}

} // namespace scene_bodies_test
