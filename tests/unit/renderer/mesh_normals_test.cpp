// SPDX-License-Identifier: Apache-2.0
// Normals that mesh files lack, by Lambert's law; text of mesh files from any system.
#include "renderer/materials/lambert.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/mesh_files/vertex_normals.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/mesh_texts.hpp"
#include "tests/support/mesh_volume.hpp"
#include "tests/support/temp_folder.hpp"

#include <chrono>
#include <map>

namespace mesh_normals_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// Box of 1 x 2 x 3 m around the origin.
Facets box() {
    Facets box;
    for (unsigned i = 0; i < 8; ++i)
        box.corners.push_back(
            {(i & 1) != 0 ? 0.5F : -0.5F, (i & 2) != 0 ? 1.0F : -1.0F, (i & 4) != 0 ? 1.5F : -1.5F});
    const std::uint16_t quads[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 1, 5, 4},
                                       {2, 6, 7, 3}, {0, 4, 6, 2}, {1, 3, 7, 5}};
    for (const auto& q : quads) {
        box.faces.push_back({q[0], q[1], q[2]});
        box.faces.push_back({q[0], q[2], q[3]});
    }
    return box;
}

/// Sphere of 1 m, 48 x 24 facets. Its coordinates are multiples of 1/65536, which every format holds exactly.
Facets sphere() {
    Facets sphere;
    constexpr std::uint16_t around = 48, up = 24;
    const auto add = [&](double polar, double azimuth) {
        const Vec3 p{std::sin(polar) * std::cos(azimuth), std::sin(polar) * std::sin(azimuth),
                     std::cos(polar)};
        const auto exact = [](double x) { return static_cast<float>(std::round(x * 65536) / 65536); };
        sphere.corners.push_back({exact(p.x), exact(p.y), exact(p.z)});
    };
    add(0, 0);
    for (std::uint16_t i = 1; i < up; ++i)
        for (std::uint16_t k = 0; k < around; ++k)
            add(std::numbers::pi * i / up, 2 * std::numbers::pi * k / around);
    add(std::numbers::pi, 0);
    const auto at = [&](int ring, int k) {
        if (ring == 0) return std::uint16_t{0};
        if (ring == up) return static_cast<std::uint16_t>(sphere.corners.size() - 1);
        return static_cast<std::uint16_t>(1 + (ring - 1) * around + k % around);
    };
    for (int i = 0; i < up; ++i)
        for (int k = 0; k < around; ++k) {
            if (i > 0) sphere.faces.push_back({at(i, k), at(i + 1, k), at(i, k + 1)});
            if (i + 1 < up) sphere.faces.push_back({at(i, k + 1), at(i + 1, k), at(i + 1, k + 1)});
        }
    return sphere;
}

/// The facets in every format, and with normals that are none, by file name.
std::map<std::string, std::string> all_formats(const Facets& of) {
    std::string zero = "vn 0 0 0\n";
    for (const auto& c : of.corners)
        zero += fmt::format("v {}\n", fmt::join(c, " "));
    for (const auto& f : of.faces)
        zero += fmt::format("f {}//1 {}//1 {}//1\n", f[0] + 1, f[1] + 1, f[2] + 1);
    return {{"bare.obj", obj_text(of)},
            {"rich.obj", "usemtl blue\n" + obj_text(of)},
            {"zero.obj", zero},
            {"nan.obj", "vn nan 0 0\n" + zero.substr(zero.find('v', 1))},
            {"t.tab", plate_text(of)},
            {"t.stl", stl_text(of)},
            {"t.ply", ply_text(of)},
            {"zero.ply", ply_text(of, "0 0 0")},
            {"t.dae", collada_text(of, "Z_UP", 1)},
            {"t.gltf", gltf_text(of)},
            {"t.3ds", studio_bytes(of)}};
}

constexpr std::int32_t size_px = 48;
const Vec3 to_sun = normalized(Vec3{0.6, -1, 0.5});
const Vec3 to_camera = normalized(Vec3{0.2, -1, 0.1});

/// Radiance of a mesh of albedo 0.5 in units of the Sun's over pi, from 1 km.
std::vector<float> picture(const std::string& file, bool smooth) {
    scene::Scene s;
    s.bodies.push_back({"m", MeshFileParameters{file, 1, smooth}, LambertParameters{0.5}, {}});
    s.sun.position_m = astronomical_unit_m * to_sun;
    s.quantity = scene::Quantity::radiance;
    s.camera = camera_at(1000 * to_camera, size_px, 4e-3 / size_px);
    s.camera.psf_sigma_px = 0;
    s.bands = {{540e-9, 560e-9}};
    std::vector<float> image = render_window(Renderer(s, {4, 1, 1}), {0, 0, size_px, size_px});
    for (float& value : image)
        value *= static_cast<float>(std::numbers::pi / sun_irradiance_w_m2(s.bands[0]));
    return image;
}

double volume_of(const std::string& file) {
    return test::volume_m3(read_mesh_file({file, 1, true}));
}

} // namespace

TEST_CASE("a closed box without normals is shaded flat in every format") {
    const TempFolder folder;
    const std::vector<float> flat = picture(folder.write("flat.obj", obj_text(box())).string(), false);
    // Lambert's law for the face towards the camera, -y.
    CHECK_THAT(flat[size_px * size_px / 2 + size_px / 2 - 3], WithinRel(0.5 * -to_sun.y, 1e-3));
    for (const auto& [name, bytes] : all_formats(box())) {
        INFO(name);
        const std::vector<float> image = picture(folder.write(name, bytes).string(), true);
        for (std::size_t i = 0; i < image.size(); ++i)
            REQUIRE_THAT(image[i], WithinAbs(flat[i], 1e-6));
    }
}

TEST_CASE("a sphere without normals is shaded smooth and alike in every format") {
    const TempFolder folder;
    const std::vector<float> bare = picture(folder.write("s.obj", obj_text(sphere())).string(), true);
    // Lambert's law in the middle, where the sphere's normal points to the camera.
    CHECK_THAT(bare[size_px * size_px / 2 + size_px / 2], WithinRel(0.5 * dot(to_sun, to_camera), 0.02));
    for (const auto& [name, bytes] : all_formats(sphere())) {
        INFO(name);
        const std::string file = folder.write(name, bytes).string();
        const std::vector<float> image = picture(file, true);
        for (std::size_t i = 0; i < image.size(); ++i)
            REQUIRE_THAT(image[i], WithinAbs(bare[i], 1e-6));
        const TriangleMesh mesh = read_mesh_file({file, 1, true});
        CHECK(mesh.vertices.size() == sphere().corners.size());
        for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
            const Vec3f p = mesh.vertices[i], n = mesh.normals[i];
            REQUIRE(p.x * n.x + p.y * n.y + p.z * n.z > 0.9998); // 1.1 degrees
        }
    }
}

TEST_CASE("vertices a millionth of a unit apart stay apart") {
    const TempFolder folder;
    Facets small = box();
    for (auto& corner : small.corners)
        for (float& x : corner)
            x *= 1.0F / (1 << 20);
    for (const auto& [name, bytes] : all_formats(small)) {
        INFO(name);
        const TriangleMesh mesh = read_mesh_file({folder.write(name, bytes).string(), 1 << 20, false});
        CHECK(mesh.triangles.size() == 12);
        CHECK(mesh.vertices.size() == 8);
    }
}

TEST_CASE("good normals of a file are kept beside bad ones") {
    const TempFolder folder;
    // A box whose lower face has normals of its own, askew and of length 2; the others' are no numbers.
    std::string text = "vn 0 1.2 -1.6\nvn 0 0 0\n" + obj_text(box());
    text.erase(text.find("\nf ") + 1);
    for (std::size_t i = 0; const auto& f : box().faces)
        text += fmt::format("f {0}//{3} {1}//{3} {2}//{3}\n", f[0] + 1, f[1] + 1, f[2] + 1, i++ < 2 ? 1 : 2);
    const TriangleMesh mesh = read_mesh_file({folder.write("some.obj", text).string(), 1, true});
    REQUIRE(mesh.triangles.size() == 12);
    CHECK(mesh.vertices.size() == 24);
    for (std::size_t t = 0; t < 12; ++t) {
        const auto at = [&](std::size_t k) {
            const Vec3f p = mesh.vertices[mesh.triangles[t][k]];
            return Vec3{p.x, p.y, p.z};
        };
        const Vec3 facet = normalized(cross(at(1) - at(0), at(2) - at(0)));
        const Vec3 wanted = facet.z < -0.5 ? Vec3{0, 0.6, -0.8} : facet;
        for (const std::uint32_t v : mesh.triangles[t]) {
            const Vec3f n = mesh.normals[v];
            CHECK(length(Vec3{n.x, n.y, n.z} - wanted) < 1e-6);
        }
    }
}

TEST_CASE("creases lie where facets meet at 80 degrees or more") {
    for (const double angle_deg : {79.9, 80.1}) {
        const double angle = angle_deg / 180 * std::numbers::pi;
        TriangleMesh roof;
        roof.vertices = {{0, 0, 0},
                         {0, 1, 0},
                         {1, 0, 0},
                         {static_cast<float>(-std::cos(angle)), 0, static_cast<float>(-std::sin(angle))}};
        roof.triangles = {{0, 2, 1}, {0, 1, 3}};
        complete_normals(roof);
        CHECK(roof.vertices.size() == (angle_deg < 80 ? 4 : 6));
    }
}

TEST_CASE("normals of a fan with very many facets take linear time") {
    // A steep cone: all facets meet at its tip, at angles up to 160 degrees.
    TriangleMesh cone;
    constexpr std::uint32_t facets = 1'000'000;
    cone.vertices.push_back({0, 0, 5});
    for (std::uint32_t i = 0; i < facets; ++i) {
        const double a = 2 * std::numbers::pi * i / facets;
        cone.vertices.push_back({static_cast<float>(std::cos(a)), static_cast<float>(std::sin(a)), 0});
        cone.triangles.push_back({0, 1 + i, 1 + (i + 1) % facets});
    }
    validate(cone, "cone");
    complete_normals(cone); // in quadratic time it would outlast the test's limit by far
    CHECK(cone.vertices.size() <= 2 * facets + 1);
}

TEST_CASE("text of mesh files is read whatever system wrote it") {
    const TempFolder folder;
    const auto with_cr = [](std::string text) {
        std::replace(text.begin(), text.end(), '\n', '\r');
        return text;
    };
    const auto in_capitals = [](std::string text) {
        for (char& c : text)
            c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
        return text;
    };
    const auto continued = [](std::string text) {
        for (std::size_t at = text.find("\nf "); at != std::string::npos; at = text.find("\nf ", at + 3))
            text.insert(text.find(' ', at + 3), " \\\n");
        return text;
    };
    for (auto [name, text] : all_formats(box())) {
        if (name == "t.3ds") continue;
        INFO(name);
        CHECK_THAT(volume_of(folder.write(name, "\xEF\xBB\xBF" + text).string()), WithinRel(6, 1e-6));
        CHECK_THAT(volume_of(folder.write(name, with_cr(text)).string()), WithinRel(6, 1e-6));
        CHECK_THAT(volume_of(folder.write(name, text + std::string(512, '\0')).string()), WithinRel(6, 1e-6));
        if (name.ends_with(".obj"))
            CHECK_THAT(volume_of(folder.write(name, continued(text)).string()), WithinRel(6, 1e-6));
        if (name == "t.stl")
            CHECK_THAT(volume_of(folder.write(name, in_capitals(text)).string()), WithinRel(6, 1e-6));
    }
}

} // namespace mesh_normals_test
