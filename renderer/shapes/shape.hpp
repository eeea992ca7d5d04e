// SPDX-License-Identifier: Apache-2.0
// The one interface of everything that has a surface.
#pragma once

#include "renderer/packets/packet.hpp"

#include <memory>

namespace obscura::renderer {

/// A surface in its own (body) frame, metres. Immutable; any thread may call any member.
class Shape {
public:
    virtual ~Shape() = default;

    /// Radius of the sphere about the origin that holds the whole shape.
    [[nodiscard]] virtual double bounding_radius_m() const = 0;
    /// Whether a point of the surface can lie in the shadow of another point of the same surface's lit side.
    [[nodiscard]] virtual bool shadows_itself() const = 0;

    /// Switches off lanes of `near` whose rays cannot meet the surface, not even when turned by up to
    /// `slack_rad` about their origin, which is the same for all. May leave any on.
    virtual void cull(const RayPacket& /*rays*/, double /*slack_rad*/, Lanes& /*near*/) const {}

    /// Nearest hits of the active rays, 0 < t < hits.t. Writes t, primitive, u, v and `body` where nearer.
    virtual void intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const = 0;
    /// Switches off the active lanes that meet the surface at 0 < t < t_max.
    virtual void occlude(RayPacket& rays) const = 0;
    /// The surface at the hits of `body`; the normals face the ray's origin.
    virtual void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                         SurfacePacket& out) const = 0;

    /// Texture coordinates of the shape's own at the hits of `body`, whose `surface` has been filled; false:
    /// it has none.
    virtual bool chart(const HitPacket& /*hits*/, std::int32_t /*body*/, const SurfacePacket& /*surface*/,
                       ChartPacket& /*out*/) const {
        return false;
    }
    /// Which of the shape's materials a primitive is made of.
    [[nodiscard]] virtual std::size_t part(std::uint32_t /*primitive*/) const { return 0; }

    /// Area over which points can be drawn uniformly, m2; 0: not offered.
    [[nodiscard]] virtual double sampled_area_m2() const { return 0; }
    /// A point of that area and the outer normal there, from u, v in [0,1).
    virtual void sample_area(double /*u*/, double /*v*/, Vec3& /*position*/, Vec3& /*normal*/) const {}
};

} // namespace obscura::renderer
