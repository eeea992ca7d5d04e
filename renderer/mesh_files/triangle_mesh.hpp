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

/// Material of a mesh file.
struct MeshMaterial {
    std::string name;
    std::array<float, 3> diffuse{0.6F, 0.6F, 0.6F};       ///< red, green, blue reflectance
    std::filesystem::path albedo_texture, normal_texture; ///< empty: none
};

/// Vertices in metres, in the body's frame; triangles wind counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<Vec3f> vertices;
    std::vector<Vec3f> normals; ///< one per vertex, unit; empty: flat
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

/// Facets that meet at a larger angle have a crease between them, as far as a file has no normals there, deg.
inline constexpr double crease_deg = 80;

/// Fills in the normals that are missing (`normals` empty) or not finite: at a corner of a facet the mean of
/// the normals of the facets that meet there, weighted by their angles (Thuermer and Wuethrich, Computing
/// Vertex Normals from Polygonal Facets, JGT 3(1), 1998), but for those
/// that meet it at more than `max_angle_deg` (180: none). Facets
/// meet where vertices are at one place. Splits vertices whose corners have different normals.
void complete_normals(TriangleMesh& mesh, double max_angle_deg = crease_deg);

} // namespace obscura::renderer
