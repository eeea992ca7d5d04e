// SPDX-License-Identifier: Apache-2.0
// Gnomonic cube sphere: six faces whose lines of constant u and v are planes through the centre.
#pragma once

#include "core/geometry.hpp"

#include <array>
#include <cmath>

namespace obscura::terrain {

/// Face of the cube: its direction is sign * e(axis), u and v run along +e(u_axis) and +e(v_axis), -1 to 1.
/// A point p of the face has u = p[u_axis] / w and v = p[v_axis] / w with w = sign * p[axis] > 0. Faces that
/// meet share the points of their edge.
struct CubeFace {
    int axis, u_axis, v_axis;
    double sign;
};

inline constexpr std::size_t cube_face_count = 6;
inline constexpr std::array<CubeFace, cube_face_count> cube_faces{
    {{0, 1, 2, 1}, {0, 1, 2, -1}, {1, 2, 0, 1}, {1, 2, 0, -1}, {2, 0, 1, 1}, {2, 0, 1, -1}}};

[[nodiscard]] constexpr double component(Vec3 p, int axis) {
    return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

/// Index of the face that the direction of `p` (any length above 0) is on; on an edge, one of those.
[[nodiscard]] inline std::size_t cube_face_of(Vec3 p) {
    const double x = std::abs(p.x), y = std::abs(p.y), z = std::abs(p.z);
    if (x >= y && x >= z) return p.x >= 0 ? 0 : 1;
    if (y >= z) return p.y >= 0 ? 2 : 3;
    return p.z >= 0 ? 4 : 5;
}

/// The point (u, v) of the face, on the cube of half-width 1 (not normalised).
[[nodiscard]] constexpr Vec3 cube_point(const CubeFace& face, double u, double v) {
    const auto at = [&](int axis) { return axis == face.axis ? face.sign : axis == face.u_axis ? u : v; };
    return {at(0), at(1), at(2)};
}

} // namespace obscura::terrain
