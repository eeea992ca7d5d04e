// SPDX-License-Identifier: Apache-2.0
#include "renderer/mesh_files/triangle_mesh.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

Vec3 widen(Vec3f a) {
    return {a.x, a.y, a.z};
}
Vec3f narrow(Vec3 a) {
    return {static_cast<float>(a.x), static_cast<float>(a.y), static_cast<float>(a.z)};
}

} // namespace

void validate(TriangleMesh& mesh, const std::string& source) {
    if (mesh.triangles.empty())
        throw InputError(fmt::format("{}: no triangles: a mesh needs at least one face", source));
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i)
        if (!is_finite(widen(mesh.vertices[i])))
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
        const Vec3 a = widen(mesh.vertices[t[0]]);
        // A smaller area has no direction even in double precision.
        if (length_squared(cross(widen(mesh.vertices[t[1]]) - a, widen(mesh.vertices[t[2]]) - a)) < 1e-280)
            continue;
        if (!mesh.material_slots.empty()) mesh.material_slots[kept] = mesh.material_slots[i];
        mesh.triangles[kept++] = t;
    }
    mesh.triangles.resize(kept);
    if (!mesh.material_slots.empty()) mesh.material_slots.resize(kept);
    if (mesh.triangles.empty())
        throw InputError(fmt::format("{}: every triangle has zero area: nothing could be seen", source));
}

void smooth_normals(TriangleMesh& mesh) {
    std::vector<Vec3> sums(mesh.vertices.size());
    for (const auto& t : mesh.triangles) {
        const Vec3 p[3] = {widen(mesh.vertices[t[0]]), widen(mesh.vertices[t[1]]),
                           widen(mesh.vertices[t[2]])};
        const Vec3 facet = normalized(cross(p[1] - p[0], p[2] - p[0]));
        for (int k = 0; k < 3; ++k) {
            const Vec3 a = normalized(p[(k + 1) % 3] - p[k]);
            const Vec3 b = normalized(p[(k + 2) % 3] - p[k]);
            const double angle = std::atan2(length(cross(a, b)), dot(a, b));
            sums[t[static_cast<std::size_t>(k)]] = sums[t[static_cast<std::size_t>(k)]] + angle * facet;
        }
    }
    mesh.normals.resize(mesh.vertices.size());
    for (std::size_t i = 0; i < sums.size(); ++i) {
        const double n = length(sums[i]);
        // The normals of opposite facets at a vertex can cancel: use any unit vector there.
        mesh.normals[i] = n > 1e-9 ? narrow(sums[i] / n) : Vec3f{0, 0, 1};
    }
}

} // namespace obscura::renderer
