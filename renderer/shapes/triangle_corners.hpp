// SPDX-License-Identifier: Apache-2.0
// Corners of triangles in double precision, and their bounding box.
#pragma once

#include "core/geometry.hpp"

#include <algorithm>
#include <array>
#include <limits>
#include <span>

namespace obscura::renderer {

/// Corners of a triangle in the body frame, metres; counter-clockwise seen from outside.
using TriangleCorners = std::array<Vec3, 3>;

/// Axis-aligned bounding box; `least` exceeds `largest` where there is nothing.
struct Bounds {
    Vec3 least, largest;

    [[nodiscard]] Vec3 centre() const { return (least + largest) / 2; }
    [[nodiscard]] double diagonal() const { return length(largest - least); }
};

[[nodiscard]] inline Bounds bounds_of(std::span<const TriangleCorners> triangles) {
    constexpr double infinite = std::numeric_limits<double>::infinity();
    Bounds b{{infinite, infinite, infinite}, {-infinite, -infinite, -infinite}};
    for (const TriangleCorners& t : triangles)
        for (const Vec3 p : t) {
            b.least = {std::min(b.least.x, p.x), std::min(b.least.y, p.y), std::min(b.least.z, p.z)};
            b.largest = {std::max(b.largest.x, p.x), std::max(b.largest.y, p.y), std::max(b.largest.z, p.z)};
        }
    return b;
}

} // namespace obscura::renderer
