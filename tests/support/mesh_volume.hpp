// SPDX-License-Identifier: Apache-2.0
// Volume of a closed mesh, by its facets.
#pragma once

#include "renderer/mesh_files/triangle_mesh.hpp"

#include <cstddef>

namespace obscura::test {

/// By the divergence theorem; m3.
inline double volume_m3(const renderer::TriangleMesh& mesh) {
    double six = 0;
    for (const auto& t : mesh.triangles) {
        const auto at = [&](std::size_t k) { return renderer::to_double(mesh.vertices[t[k]]); };
        six += dot(at(0), cross(at(1), at(2)));
    }
    return six / 6;
}

} // namespace obscura::test
