// SPDX-License-Identifier: Apache-2.0
// A wavy ground of any number of triangles, for measuring what meshes cost.
#pragma once

#include "renderer/mesh_files/vertex_normals.hpp"

#include <cmath>
#include <cstdint>

namespace obscura::test {

/// 2 side^2 triangles, 1 m wide, 5 m up and down over `wavelength_m`, smoothed.
inline renderer::TriangleMesh wavy_mesh(std::uint32_t side, double wavelength_m) {
    const double k = 6.283185307179586 / wavelength_m;
    renderer::TriangleMesh mesh;
    for (std::uint32_t y = 0; y <= side; ++y)
        for (std::uint32_t x = 0; x <= side; ++x)
            mesh.vertices.push_back({static_cast<float>(x), static_cast<float>(y),
                                     static_cast<float>(5 * std::sin(k * x) * std::cos(1.3 * k * y))});
    for (std::uint32_t y = 0; y < side; ++y)
        for (std::uint32_t x = 0; x < side; ++x) {
            const std::uint32_t a = y * (side + 1) + x;
            mesh.triangles.push_back({a, a + 1, a + side + 2});
            mesh.triangles.push_back({a, a + side + 2, a + side + 1});
        }
    renderer::complete_normals(mesh, 180);
    return mesh;
}

} // namespace obscura::test
