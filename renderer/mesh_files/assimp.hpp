// SPDX-License-Identifier: Apache-2.0
// Mesh file reader on assimp, isolated in a child process.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"

#include <filesystem>

namespace obscura::renderer {

/// Reads all triangles of a mesh file, nodes transformed, with normals, texture coordinates and materials
/// (colour and texture files) where the file has them; normals only if `normals`, as the file has them: zero
/// where it lacks some, none at all for STL, which has those of facets only.
///
/// assimp is not written for hostile files: it runs in a child process, so that any fault ends as an
/// InputError with one line here. Limits: 8 GB of memory, and 1 s of CPU time plus 4 s for each megabyte of
/// the file.
[[nodiscard]] TriangleMesh read_with_assimp(const std::filesystem::path& file, double metres_per_unit,
                                            bool normals);

} // namespace obscura::renderer
