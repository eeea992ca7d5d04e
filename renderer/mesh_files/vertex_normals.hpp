// SPDX-License-Identifier: Apache-2.0
// Vertex normals of triangle meshes: means over the facets within a crease angle.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"

namespace obscura::renderer {

/// Facets that meet at this angle or more have a crease between them, deg.
inline constexpr double crease_deg = 80;

/// Makes normals unit vectors and replaces those that a mesh lacks: none at all (`normals` empty), of no
/// length, or not finite. A facet's corner then has the mean of the normals of the facets that share its
/// point, whichever vertices they name it by, and meet it at less than `max_angle_deg` (180: of all),
/// weighted by the facets' angles there (Thuermer and Wuethrich, Computing Vertex Normals from Polygonal
/// Facets, JGT 3(1), 1998). Vertices whose corners differ are split. Where more than 256 facets share a point
/// and do not all meet at less than that angle, each has its own normal there, so that the time stays linear.
/// `mesh` must have passed validate(). Reentrant.
void complete_normals(TriangleMesh& mesh, double max_angle_deg = crease_deg);

} // namespace obscura::renderer
