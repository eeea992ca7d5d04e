// SPDX-License-Identifier: Apache-2.0
// Reader of plate models of the Planetary Data System (.tab, .plt): strict, errors name the line.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"

#include <string>
#include <string_view>

namespace obscura::renderer {

/// Reads a shape model of triangular plates, scaled to metres. Two layouts: lines `v x y z` and `f a b c`
/// (NEAR), and tables with the number of vertices, lines `id x y z`, the number of plates, lines `id a b c`
/// (Gaskell and others). Plates count vertices from 0 if any plate names vertex 0, else from 1. Throws
/// InputError with `name:line: what is wrong`.
[[nodiscard]] TriangleMesh parse_plates(std::string_view text, const std::string& name,
                                        double metres_per_unit);

} // namespace obscura::renderer
