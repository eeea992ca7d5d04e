// SPDX-License-Identifier: Apache-2.0
// Normals of meshes whose files have none, or such as are no directions: alike in every format, of a box
// those of its faces, of a sphere nearly radial.
#include "renderer/mesh_files/mesh_file.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

namespace mesh_normals_test {

using namespace obscura;
using namespace obscura::renderer;

namespace {

struct Plain {
    std::vector<Vec3> vertices;
    std::vector<std::array<std::size_t, 3>> facets;
};

Plain box() {
    Plain p;
    for (int i = 0; i < 8; ++i)
        p.vertices.push_back(
            {(i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 1.0 : -1.0, (i & 4) != 0 ? 1.5 : -1.5});
    const std::array<std::array<std::size_t, 4>, 6> faces{
        {{0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}, {0, 2, 3, 1}, {4, 5, 7, 6}}};
    for (const auto& f : faces) {
        p.facets.push_back({f[0], f[1], f[2]});
        p.facets.push_back({f[0], f[2], f[3]});
    }
    return p;
}

Plain sphere() {
    constexpr std::size_t n = 24, m = 12;
    Plain p;
    p.vertices.push_back({0, 0, 1});
    for (std::size_t j = 1; j < m; ++j)
        for (std::size_t i = 0; i < n; ++i) {
            const double t = std::numbers::pi * static_cast<double>(j) / m;
            const double f = 2 * std::numbers::pi * static_cast<double>(i) / n;
            p.vertices.push_back({std::sin(t) * std::cos(f), std::sin(t) * std::sin(f), std::cos(t)});
        }
    p.vertices.push_back({0, 0, -1});
    const auto at = [&](std::size_t j, std::size_t i) { return 1 + (j - 1) * n + i % n; };
    for (std::size_t i = 0; i < n; ++i) {
        p.facets.push_back({0, at(1, i), at(1, i + 1)});
        for (std::size_t j = 1; j + 1 < m; ++j) {
            p.facets.push_back({at(j, i), at(j + 1, i), at(j + 1, i + 1)});
            p.facets.push_back({at(j, i), at(j + 1, i + 1), at(j, i + 1)});
        }
        p.facets.push_back({at(m - 1, i), p.vertices.size() - 1, at(m - 1, i + 1)});
    }
    return p;
}

std::string obj(const Plain& p, const std::string& normal) {
    std::string text;
    for (const Vec3& v : p.vertices)
        text += fmt::format("v {} {} {}\n", v.x, v.y, v.z);
    if (!normal.empty()) text += "vn " + normal + "\n";
    const char* const with = normal.empty() ? "" : "//1";
    for (const auto& f : p.facets)
        text += fmt::format("f {0}{3} {1}{3} {2}{3}\n", f[0] + 1, f[1] + 1, f[2] + 1, with);
    return text;
}

std::string ply(const Plain& p) {
    std::string text =
        fmt::format("ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\n"
                    "property float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
                    p.vertices.size(), p.facets.size());
    for (const Vec3& v : p.vertices)
        text += fmt::format("{} {} {}\n", v.x, v.y, v.z);
    for (const auto& f : p.facets)
        text += fmt::format("3 {} {} {}\n", f[0], f[1], f[2]);
    return text;
}

std::string stl(const Plain& p) {
    std::string text = "solid a\n";
    for (const auto& f : p.facets) {
        text += "facet normal 0 0 0\nouter loop\n";
        for (const std::size_t v : f)
            text += fmt::format("vertex {} {} {}\n", p.vertices[v].x, p.vertices[v].y, p.vertices[v].z);
        text += "endloop\nendfacet\n";
    }
    return text + "endsolid a\n";
}

std::string plates(const Plain& p) {
    std::string text = fmt::format("{} {}\n", p.vertices.size(), p.facets.size()); // DAMIT
    for (const Vec3& v : p.vertices)
        text += fmt::format("{} {} {}\n", v.x, v.y, v.z);
    for (const auto& f : p.facets)
        text += fmt::format("{} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1);
    return text;
}

std::vector<TriangleMesh> in_all_formats(const test::TempFolder& folder, const Plain& p) {
    std::vector<TriangleMesh> all;
    const auto add = [&](const char* name, const std::string& text) {
        MeshFileParameters parameters;
        parameters.path = folder.write(name, text).string();
        all.push_back(read_mesh_file(parameters));
    };
    add("bare.obj", obj(p, ""));
    add("zero.obj", obj(p, "0 0 0"));
    add("none.obj", obj(p, "nan 0 0"));
    add("a.ply", ply(p));
    add("a.stl", stl(p));
    add("a.txt", plates(p));
    return all;
}

Vec3 wide(const Vec3f& v) {
    return {v.x, v.y, v.z};
}

} // namespace

TEST_CASE("corners of a box have the normals of their faces in every format") {
    const test::TempFolder folder;
    for (const TriangleMesh& mesh : in_all_formats(folder, box())) {
        REQUIRE(mesh.triangles.size() == 12);
        for (const auto& t : mesh.triangles) {
            const Vec3 facet = normalized(cross(wide(mesh.vertices[t[1]]) - wide(mesh.vertices[t[0]]),
                                                wide(mesh.vertices[t[2]]) - wide(mesh.vertices[t[0]])));
            for (const std::uint32_t v : t)
                CHECK(length(wide(mesh.normals[v]) - facet) < 1e-6);
        }
    }
}

TEST_CASE("a sphere has the same normals in every format, nearly radial") {
    const test::TempFolder folder;
    // Readers round the same text differently, in the last bit.
    const auto rounded = [](float x) { return std::lround(static_cast<double>(x) * 1e5); };
    std::map<std::tuple<long, long, long>, Vec3> first;
    for (const TriangleMesh& mesh : in_all_formats(folder, sphere()))
        for (const auto& t : mesh.triangles)
            for (const std::uint32_t v : t) {
                const Vec3f& p = mesh.vertices[v];
                const Vec3 n = wide(mesh.normals[v]);
                CHECK(dot(n, normalized(wide(p))) > 0.999);
                const auto [at, added] =
                    first.emplace(std::tuple(rounded(p.x), rounded(p.y), rounded(p.z)), n);
                if (!added) CHECK(length(at->second - n) < 1e-6);
            }
    CHECK(first.size() == sphere().vertices.size());
}

} // namespace mesh_normals_test
