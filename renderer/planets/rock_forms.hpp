// SPDX-License-Identifier: Apache-2.0
// Forms of boulders: a few angular rocks that all boulders are stretched copies of.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"

#include <cstdint>
#include <vector>

namespace obscura::renderer {

inline constexpr std::uint32_t rock_form_count = 8;

/// Balls cut by planes, whose extent along each axis is -1 to 1, with smooth normals. The same everywhere.
[[nodiscard]] std::vector<TriangleMesh> make_rock_forms();

} // namespace obscura::renderer
