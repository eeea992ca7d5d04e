// SPDX-License-Identifier: Apache-2.0
// Mesh files through assimp, which is kept in a process of its own.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"

#include <filesystem>

namespace obscura::renderer {

/// Reads every triangle of a mesh file, nodes put in place, with normals, texture coordinates and materials
/// (colour and texture files) where the file has them; without `normals` none. Normals that the file lacks
/// (and the facet normals of STL) are means over the facets that meet at less than 80 degrees. assimp is not
/// written for hostile files: it runs in a child process, so that whatever a file does to it ends as an
/// InputError with one line here. The file is bounded by 8 GB and by 1 s of computing and 4 s more for each
/// megabyte of the file.
[[nodiscard]] TriangleMesh read_with_assimp(const std::filesystem::path& file, double metres_per_unit,
                                            bool normals);

} // namespace obscura::renderer
