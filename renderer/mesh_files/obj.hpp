// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ reader for shape models: strict, errors name the line.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"

#include <string>
#include <string_view>

namespace obscura::renderer {

/// Reads the vertices (`v`) and faces (`f`, any polygon, fanned into triangles; negative indices count back)
/// of an OBJ text, scaled to metres. Groups, materials, texture coordinates and stored normals are skipped.
/// Throws InputError with `name:line: what is wrong`.
[[nodiscard]] TriangleMesh parse_obj(std::string_view text, const std::string& name, double metres_per_unit);

} // namespace obscura::renderer
