// Triangles as plain data, and the checks every mesh passes before it is used.
#pragma once

#include "core/geometry.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::renderer {

struct Vec3f {
    float x = 0, y = 0, z = 0;
};

/// Vertices in metres, in the body's frame; triangles wind counter-clockwise seen from outside.
struct TriangleMesh {
    std::vector<Vec3f> vertices;
    std::vector<Vec3f> normals; ///< one per vertex, unit; empty: flat
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Throws InputError (`source: what is wrong`) unless the mesh has triangles, all indices are in range and
/// all vertices are finite. Triangles without area are taken out.
void validate(TriangleMesh& mesh, const std::string& source);

/// Fills `normals` with the means of the adjoining facets' normals, weighted by the facets' angles at the
/// vertex (Thuermer and Wuethrich, Computing Vertex Normals from Polygonal Facets, JGT 3(1), 1998).
void smooth_normals(TriangleMesh& mesh);

} // namespace obscura::renderer
