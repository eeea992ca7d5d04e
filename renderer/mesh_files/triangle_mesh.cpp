// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/triangle_mesh.hpp"

#include "core/error.hpp"
#include "renderer/mesh_files/distinct.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::renderer {

void validate(TriangleMesh& mesh, const std::string& source) {
    if (mesh.triangles.empty())
        throw InputError(fmt::format("{}: no triangles: a mesh needs at least one face", source));
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        if (!is_finite(to_double(mesh.vertices[i])))
            throw InputError(fmt::format(
                "{}: vertex {} is not finite in metres as a 32-bit number (at most 3.4e38)", source, i + 1));
    for (std::size_t i = 0; i < mesh.uvs.size(); ++i)
        if (!std::isfinite(mesh.uvs[i][0]) || !std::isfinite(mesh.uvs[i][1]))
            throw InputError(fmt::format("{}: texture coordinate {} is not finite", source, i + 1));
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i)
        for (const std::uint32_t index : mesh.triangles[i])
            if (index >= mesh.vertices.size())
                throw InputError(fmt::format("{}: face {} uses vertex {}: there are {}", source, i + 1,
                                             index + 1, mesh.vertices.size()));
    std::size_t kept = 0;
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        const auto& t = mesh.triangles[i];
        const Vec3 a = to_double(mesh.vertices[t[0]]);
        // A smaller area has no direction even in double precision.
        if (length_squared(cross(to_double(mesh.vertices[t[1]]) - a, to_double(mesh.vertices[t[2]]) - a)) <
            1e-280)
            continue;
        if (!mesh.material_slots.empty()) mesh.material_slots[kept] = mesh.material_slots[i];
        mesh.triangles[kept++] = t;
    }
    mesh.triangles.resize(kept);
    if (!mesh.material_slots.empty()) mesh.material_slots.resize(kept);
    if (mesh.triangles.empty())
        throw InputError(fmt::format("{}: every triangle has zero area: nothing could be seen", source));
}

void join_vertices(TriangleMesh& mesh) {
    const bool normals = !mesh.normals.empty(), uvs = !mesh.uvs.empty();
    std::uint32_t count = 0;
    const std::vector<std::uint32_t> numbers = number_distinct(
        mesh.vertices.size(), count,
        [&](std::size_t i) {
            const Vec3f p = mesh.vertices[i];
            const Vec3f n = normals ? mesh.normals[i] : Vec3f{};
            const std::array<float, 2> t = uvs ? mesh.uvs[i] : std::array<float, 2>{};
            return hash_floats({p.x, p.y, p.z, n.x, n.y, n.z, t[0], t[1]});
        },
        [&](std::size_t i, std::size_t j) {
            return is_same(mesh.vertices[i], mesh.vertices[j]) &&
                   (!normals || is_same(mesh.normals[i], mesh.normals[j])) &&
                   (!uvs || mesh.uvs[i] == mesh.uvs[j]);
        });
    // Numbers grow in order of first appearance: each vertex moves down to its place or not at all.
    std::uint32_t next = 0;
    for (std::size_t i = 0; i < numbers.size(); ++i)
        if (numbers[i] == next) {
            mesh.vertices[next] = mesh.vertices[i];
            if (normals) mesh.normals[next] = mesh.normals[i];
            if (uvs) mesh.uvs[next] = mesh.uvs[i];
            ++next;
        }
    mesh.vertices.resize(count);
    if (normals) mesh.normals.resize(count);
    if (uvs) mesh.uvs.resize(count);
    for (auto& t : mesh.triangles)
        for (std::uint32_t& v : t)
            v = numbers[v];
}

} // namespace obscura::renderer
