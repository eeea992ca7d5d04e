// SPDX-License-Identifier: Apache-2.0
// Triangle list: intersects packets with every triangle of a small mesh, where that is faster than a BVH.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/shapes/triangle_corners.hpp"

#include <cstddef>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Intersects packets with every triangle, in double precision throughout. Immutable; thread-safe.
///
/// Each triangle is its plane and two planes that give the barycentric coordinates (Havel and Herout, Yet
/// Faster Ray-Triangle Intersection (Using SSE4), IEEE TVCG 16(3), 2010); the division is done for hits only.
/// Coordinates count as inside to 1e-12 beyond an edge, so that no ray slips between neighbours.
class TriangleList {
public:
    /// Largest number of triangles.
    static constexpr std::size_t most = 16;

    /// `first_primitive`: of the hits of the first triangle.
    explicit TriangleList(std::span<const TriangleCorners> triangles, std::size_t first_primitive = 0);

    /// As Shape::intersect() and Shape::occlude(). `limit`: the nearest hit so far, or the end of the ray.
    void intersect(const RayPacket& rays, Doubles& limit, std::int32_t body, HitPacket& hits) const;
    void occlude(RayPacket& rays) const;

    struct Plane {
        double x, y, z, d;
    };
    struct Triangle {
        Plane face;   ///< normal x and y and z, not of unit length; d: normal times a point
        Plane first;  ///< first barycentric coordinate of a point p: x p.x + y p.y + z p.z + d
        Plane second; ///< the second one
    };

private:
    /// Whether any active ray meets the bounding sphere.
    [[nodiscard]] bool reached(const RayPacket& rays) const;

    std::vector<Triangle> triangles_;
    std::size_t first_primitive_;
    Vec3 centre_; ///< of the bounding sphere
    double radius2_ = 0;
};

} // namespace obscura::renderer
