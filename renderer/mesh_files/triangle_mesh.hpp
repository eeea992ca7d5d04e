// SPDX-License-Identifier: Apache-2.0
// Triangle mesh as plain data, with the checks that every mesh passes before use.
#pragma once

#include "core/geometry.hpp"

#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace obscura::renderer {

struct Vec3f {
    float x = 0, y = 0, z = 0;
};
[[nodiscard]] constexpr Vec3 to_double(Vec3f a) {
    return {a.x, a.y, a.z};
}

/// Material of a mesh file.
struct MeshMaterial {
    std::string name;
    std::array<float, 3> diffuse{0.6F, 0.6F, 0.6F};       ///< red, green, blue reflectance
    std::filesystem::path albedo_texture, normal_texture; ///< empty: none
};

/// Vertices in metres, in the body's frame; triangles wind counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<Vec3f> vertices;
    std::vector<Vec3f> normals; ///< one per vertex, unit (vertex_normals.hpp); empty: flat
    std::vector<std::array<std::uint32_t, 3>> triangles;
    /// Texture coordinates, one pair per vertex: u to the right, v down from the first row of the image;
    /// empty: none.
    std::vector<std::array<float, 2>> uvs;
    /// One per triangle: index into `materials`; empty: all 0.
    std::vector<std::uint16_t> material_slots;
    std::vector<MeshMaterial> materials;
};

/// Throws InputError (`source: what is wrong`) unless the mesh has triangles, all indices are in range and
/// all vertices and texture coordinates are finite. Removes triangles without area.
void validate(TriangleMesh& mesh, const std::string& source);

/// Makes one vertex of those with the same position, normal and texture coordinates. `mesh` must have passed
/// validate(). Linear in time and memory.
void join_vertices(TriangleMesh& mesh);

} // namespace obscura::renderer
