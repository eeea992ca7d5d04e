// SPDX-License-Identifier: Apache-2.0
// The same body through every mesh format; materials, axes, units; files that are no meshes.
#include "core/error.hpp"
#include "renderer/materials/file_materials.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/mesh_files/assimp.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/mesh_texts.hpp"
#include "tests/support/mesh_volume.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/wavy_mesh.hpp"

#include <sys/stat.h>

#include <limits>
#include <map>
#include <random>

namespace mesh_files_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

/// A tetrahedron with the right angle at the origin and edges 1, 2, 3 along x, y, z.
const Facets tetrahedron{{{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}},
                         {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}};

std::string plain_obj() {
    return obj_text(tetrahedron);
}
std::string stl() {
    return stl_text(tetrahedron);
}
std::string ply() {
    return ply_text(tetrahedron);
}
std::string collada(const char* up, double unit) {
    return collada_text(tetrahedron, up, unit);
}
std::string gltf() {
    return gltf_text(tetrahedron);
}
std::string studio() {
    return studio_bytes(tetrahedron);
}

Vec3 extent(const TriangleMesh& mesh) {
    Vec3 most{-1e9, -1e9, -1e9};
    for (const auto& t : mesh.triangles)
        for (const auto i : t) {
            const Vec3f p = mesh.vertices[i];
            most = {std::max<double>(most.x, p.x), std::max<double>(most.y, p.y),
                    std::max<double>(most.z, p.z)};
        }
    return most;
}

std::string complaint(const TempFolder& folder, const std::filesystem::path& file) {
    try {
        (void)read_mesh_file({file.string(), 1, true});
    } catch (const InputError& error) {
        std::string line = error.what();
        CHECK(line.find('\n') == std::string::npos);
        const std::string prefix = folder.path().string() + "/";
        if (const auto at = line.find(prefix); at != std::string::npos) line.erase(at, prefix.size());
        return line;
    }
    return "no error";
}

} // namespace

TEST_CASE("Every mesh format gives the same body, in the file's own axes") {
    const TempFolder folder;
    const std::map<std::string, std::string> files{{"bare.obj", plain_obj()},
                                                   {"t.stl", stl()},
                                                   {"t.ply", ply()},
                                                   {"z.dae", collada("Z_UP", 1)},
                                                   {"y.dae", collada("Y_UP", 1)},
                                                   {"t.gltf", gltf()},
                                                   {"t.3ds", studio()},
                                                   {"rich.obj", "mtllib t.mtl\nusemtl blue\n" + plain_obj()}};
    (void)folder.write("t.mtl", "newmtl blue\nKd 0.25 0.5 0.75\n");
    for (const auto& [name, bytes] : files)
        for (const bool smooth : {true, false}) {
            INFO(name << (smooth ? " smooth" : " flat"));
            const TriangleMesh mesh = read_mesh_file({folder.write(name, bytes).string(), 10, smooth});
            CHECK(mesh.triangles.size() == 4);
            CHECK_THAT(test::volume_m3(mesh), WithinRel(1e3, 1e-5));
            const Vec3 most = extent(mesh);
            CHECK_THAT(most.x, WithinRel(10, 1e-5));
            CHECK_THAT(most.y, WithinRel(20, 1e-5));
            CHECK_THAT(most.z, WithinRel(30, 1e-5));
            CHECK(mesh.normals.size() == (smooth ? mesh.vertices.size() : 0));
            if (name.find(".dae") != std::string::npos || name == "t.gltf" || name == "t.3ds" ||
                name == "rich.obj") {
                REQUIRE(mesh.material_slots.size() == 4);
                const MeshMaterial& m = mesh.materials.at(mesh.material_slots[0]);
                CHECK(m.name == "blue");
                const std::array<double, 3> wanted{0.25, 0.5, 0.75};
                for (std::size_t k = 0; k < 3; ++k)
                    CHECK_THAT(m.diffuse[k], WithinAbs(wanted[k], 0.003));
            } else {
                CHECK(mesh.materials.empty());
            }
        }
    // Collada says how long its unit is.
    CHECK_THAT(
        test::volume_m3(read_mesh_file({folder.write("cm.dae", collada("Z_UP", 0.01)).string(), 1, true})),
        WithinRel(1e-6, 1e-4));
}

TEST_CASE("Texture coordinates and normals of a file are kept; v counts down") {
    const TempFolder folder;
    const auto file =
        folder.write("q.obj", "vn 0 0.6 0.8\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nv 0 0 0\nv 2 0 0\nv 2 2 "
                              "0\nv 0 2 0\nf 1/1/1 2/2/1 3/3/1 4/4/1\n");
    const TriangleMesh mesh = read_mesh_file({file.string(), 1, true});
    REQUIRE(mesh.uvs.size() == mesh.vertices.size());
    CHECK(mesh.triangles.size() == 2);
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        CHECK_THAT(mesh.uvs[i][0], WithinAbs(mesh.vertices[i].x / 2, 1e-6));
        CHECK_THAT(mesh.uvs[i][1], WithinAbs(1 - mesh.vertices[i].y / 2, 1e-6));
        CHECK_THAT(mesh.normals[i].y, WithinAbs(0.6, 1e-6));
    }
    CHECK(read_mesh_file({file.string(), 1, false}).normals.empty());
}

TEST_CASE("Files that are no meshes are refused with one line, whatever is in them") {
    const TempFolder folder;
    CHECK(complaint(folder, folder.path() / "gone.ply") ==
          "gone.ply: cannot open: a readable mesh file is wanted");
    CHECK(complaint(folder, folder.path() / "gone.obj") ==
          "gone.obj: cannot open: a readable mesh file is wanted: No such file or directory");
    for (const char* name : {"pipe.obj", "pipe.tab"}) {
        REQUIRE(mkfifo((folder.path() / name).c_str(), 0600) == 0);
        CHECK_THAT(complaint(folder, folder.path() / name),
                   ContainsSubstring(std::string(name) + ": cannot open"));
    }
    CHECK(complaint(folder, folder.write("m.tab", "1\n1 0 0 0\n1\n1 -9223372036854775808 1 1\n")) ==
          "m.tab:4: vertex -9223372036854775808 out of range: allowed are numbers from 0 up");
    CHECK(complaint(folder, folder.write("a.blend", "x")) ==
          "a.blend: mesh files whose names end in \".blend\" are not supported, allowed are .obj, .stl, "
          ".ply, .3ds, .dae, .gltf, .glb, .tab, .plt, .txt");
    for (const char* name : {"e.stl", "e.3ds", "e.dae", "e.gltf", "e.glb"}) {
        CHECK_THAT(complaint(folder, folder.write(name, "")), ContainsSubstring(std::string(name) + ": "));
        CHECK_THAT(complaint(folder, folder.write(name, std::string(5000, 'A'))),
                   ContainsSubstring(std::string(name) + ": "));
    }
    CHECK_THAT(complaint(folder,
                         folder.write("p.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float "
                                               "x\nproperty float y\nproperty float z\nend_header\n0 0 0\n")),
               ContainsSubstring("p.ply: "));
    CHECK_THAT(complaint(folder, folder.write("n.obj", "vt 0 0\nv 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n")),
               ContainsSubstring("n.obj: "));
    // The assimp of Debian 12 would look for the end of this line for ever, that of Debian 13 does not.
    CHECK_THAT(complaint(folder, folder.write("h.ply", "ply\nformat ascii ")),
               ContainsSubstring("h.ply: not readable as a mesh: "));
    // Cut short or with flipped bytes: refused or read, never worse.
    std::mt19937 random(5);
    for (const auto& [name, good] : {std::pair{std::string("f.3ds"), studio()}, {"f.gltf", gltf()}})
        for (int i = 0; i < 12; ++i) {
            std::string bad = good;
            if (i % 2 == 0)
                bad.resize(random() % bad.size());
            else
                for (int k = 0; k < 4; ++k)
                    bad[random() % bad.size()] = static_cast<char>(random());
            (void)complaint(folder, folder.write(name, bad));
        }
}

TEST_CASE("Texture coordinates that are no numbers never reach a texture") {
    TriangleMesh mesh;
    mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    mesh.triangles = {{0, 1, 2}};
    mesh.uvs = {{0, 0}, {1, std::numeric_limits<float>::infinity()}, {0, 0}};
    CHECK_THROWS_WITH(validate(mesh, "m.obj"), "m.obj: texture coordinate 2 is not finite");
    const TempFolder folder;
    const auto file = folder.write("n.obj", "vt nan inf\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1 2/1 3/1\n");
    try {
        for (const auto& uv : read_mesh_file({file.string(), 1, true}).uvs)
            CHECK((std::isfinite(uv[0]) && std::isfinite(uv[1])));
    } catch (const InputError& error) {
        CHECK(std::string(error.what()).find('\n') == std::string::npos);
    }
}

TEST_CASE("A file's materials colour the body part by part") {
    const TempFolder folder;
    (void)folder.write("two.mtl", "newmtl dark\nKd 0.1 0.1 0.1\nnewmtl red\nKd 0.8 0.4 0.2\n");
    // Two squares side by side in the x-y plane, facing +z.
    const auto file =
        folder.write("two.obj", "mtllib two.mtl\nv -1 -1 0\nv 0 -1 0\nv 0 1 0\nv -1 1 0\nv 1 -1 0\nv 1 1 "
                                "0\nusemtl dark\nf 1 2 3 4\nusemtl red\nf 2 5 6 3\n");
    scene::Scene s;
    s.bodies.push_back({"plate",
                        renderer::MeshFileParameters{file.string(), 1, false},
                        renderer::FileMaterialsParameters{},
                        {}});
    s.sun.position_m = {0, 0, astronomical_unit_m};
    s.quantity = scene::Quantity::radiance;
    s.camera = camera_at({0, 0, 100}, 32, 0.001);
    s.camera.psf_sigma_px = 0;
    s.bands = {{640e-9, 660e-9}, {590e-9, 610e-9}, {540e-9, 560e-9}, {400e-9, 420e-9}};
    const renderer::Renderer r(s, {4, 2, 1});
    const std::vector<float> image = render_window(r, {0, 0, 32, 32});
    // Left and right as the camera sees them: its up is +y.
    const std::array<double, 4> red{0.8, 0.6, 0.4, 0.2};
    int left_is_dark = 0;
    for (std::size_t b = 0; b < 4; ++b) {
        const double light = renderer::sun_irradiance_w_m2(s.bands[b]) / std::numbers::pi;
        const double left = image[(b * 32 + 16) * 32 + 12] / light;
        const double right = image[(b * 32 + 16) * 32 + 20] / light;
        left_is_dark += left < right ? 1 : 0;
        CHECK_THAT(std::min(left, right), WithinRel(0.1, 2e-3));
        CHECK_THAT(std::max(left, right), WithinRel(red[b], 2e-3));
    }
    CHECK(left_is_dark % 4 == 0);
    // A file without materials cannot give any; other shapes neither.
    const auto refusal = [](const scene::Scene& of) {
        try {
            const renderer::Renderer refused(of, {1, 1, 1});
        } catch (const Error& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    s.bodies[0].shape =
        renderer::MeshFileParameters{folder.write("bare.obj", plain_obj()).string(), 1, false};
    CHECK_THAT(refusal(s), ContainsSubstring("body 'plate': ") && ContainsSubstring("brings no materials"));
    s.bodies[0].shape = renderer::BoxParameters{};
    CHECK(refusal(s) == "body 'plate': only a mesh file can bring its own materials");
    (void)folder.write("two.mtl",
                       "newmtl dark\nKd 0.1 0.1 0.1\nmap_Kd gone.png\nnewmtl red\nKd 0.8 0.4 0.2\n");
    s.bodies[0].shape = renderer::MeshFileParameters{
        folder
            .write("tex.obj",
                   "mtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nusemtl dark\nf 1/1 2/1 3/1\n")
            .string(),
        1, false};
    CHECK_THAT(refusal(s), ContainsSubstring("gone.png: cannot be opened: No such file or directory"));
}

TEST_CASE("A large mesh takes at most 150 bytes a triangle, Embree's tree and all") {
    TriangleMesh mesh = wavy_mesh(316, 62.8); // 200 000 triangles
    const auto device = std::make_shared<const EmbreeDevice>();
    const std::int64_t before = device->bytes();
    const MeshShape shape(device, std::move(mesh));
    const auto triangles = static_cast<double>(shape.mesh().triangles.size());
    const double tree = static_cast<double>(device->bytes() - before) / triangles;
    const double all = static_cast<double>(shape.bytes()) / triangles + tree;
    INFO(tree << " + " << all - tree);
    CHECK(tree > 30);
    CHECK(all < 150);
}

TEST_CASE("Non-manifold, degenerate and zero-size meshes") {
    const TempFolder folder;
    // Three squares on one edge, and a facet given twice, are surfaces like any other.
    const auto fan =
        folder.write("fan.obj", "v 0 0 -1\nv 0 0 1\nv 1 0 1\nv 1 0 -1\nv 0 1 1\nv 0 1 -1\nv -1 -1 1\nv -1 "
                                "-1 -1\nf 1 2 3 4\nf 1 2 5 6\nf 1 2 7 8\nf 1 2 3 4\n");
    const TriangleMesh mesh = read_mesh_file({fan.string(), 1, true});
    CHECK(mesh.triangles.size() == 8);
    for (const Vec3f n : mesh.normals)
        CHECK_THAT(n.x * n.x + n.y * n.y + n.z * n.z, WithinAbs(1, 1e-5));
    scene::Scene s;
    s.bodies.push_back(
        {"fan", renderer::MeshFileParameters{fan.string(), 1, true}, renderer::LambertParameters{0.5}, {}});
    s.sun.position_m = {0, astronomical_unit_m, 0};
    s.camera = camera_at({3, 100, 0}, 32, 0.002);
    const renderer::Renderer r(s, {4, 1, 1});
    const Image image = render(r);
    CHECK(image.sum() > 0);
    for (const float v : image.values)
        REQUIRE(std::isfinite(v));
    CHECK(complaint(folder, folder.write("point.obj", "v 1 2 3\nv 1 2 3\nv 1 2 3\nf 1 2 3\n")) ==
          "point.obj: every triangle has zero area: nothing could be seen");
    CHECK(
        complaint(folder, folder.write("line.ply",
                                       "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty "
                                       "float y\nproperty float z\nelement face 1\nproperty list uchar int "
                                       "vertex_indices\nend_header\n0 0 0\n1 1 1\n2 2 2\n3 0 1 2\n")) ==
        "line.ply: every triangle has zero area: nothing could be seen");
}

TEST_CASE("Real spacecraft models are read: 3DS, OBJ with MTL, Collada") {
    const auto data = [](const char* name) { return data_file(std::string("spacecraft/") + name); };
    const auto rosetta = data("rosetta/rosetta.3ds");
    const auto hubble = data("nasa42_obj/HST.obj");
    const auto astrobee = data("astrobee_dae/base_link.dae");
    if (!rosetta || !hubble || !astrobee) return;
    for (const auto& file : {*rosetta, *hubble, *astrobee}) {
        INFO(file);
        const TriangleMesh mesh = read_mesh_file({file.string(), 1, true});
        CHECK(mesh.triangles.size() > 1000);
        CHECK(!mesh.materials.empty());
        CHECK(mesh.normals.size() == mesh.vertices.size());
    }
}

} // namespace mesh_files_test
