// SPDX-License-Identifier: Apache-2.0
// Shape interface: intersection, surface, texture coordinates and area sampling in the body frame.
#pragma once

#include "renderer/packets/packet.hpp"

#include <memory>
#include <string>
#include <vector>

namespace obscura::renderer {

class FacetSet;
class SurfaceTiles;

/// Surface of a body, in the body frame, metres. Immutable; thread-safe.
class Shape {
public:
    virtual ~Shape() = default;

    /// Radius of the bounding sphere about the origin.
    [[nodiscard]] virtual double bounding_radius_m() const = 0;
    /// Whether the lit side of the surface can shadow itself; false for convex shapes.
    [[nodiscard]] virtual bool shadows_itself() const = 0;
    /// Semi-axes if the surface is an ellipsoid about the origin, else 0.
    [[nodiscard]] virtual Vec3 ellipsoid_radii_m() const { return {0, 0, 0}; }

    /// Culling: switches off lanes of `near` whose rays cannot meet the surface, also when turned by up to
    /// `slack_rad` about their common origin. Conservative: may leave any lane on.
    virtual void cull(const RayPacket& /*rays*/, double /*slack_rad*/, Lanes& /*near*/) const {}

    /// Nearest hits of the active rays, 0 < t < hits.t. Writes t, primitive, u, v and `body` where nearer. A
    /// ray that starts on the surface, or below it by no more than rounding
    /// (renderer/shapes/own_surface.hpp), and points outwards does not hit it there.
    virtual void intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const = 0;
    /// Switches off the active lanes that meet the surface at 0 < t < t_max. Rays start clear of it.
    virtual void occlude(RayPacket& rays) const = 0;
    /// The surface at the hits of `body`; the normals face the ray's origin.
    virtual void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                         SurfacePacket& out) const = 0;

    /// What is kept of the Sun's visibility about the hits of `body`, over widths of `width_m` across the
    /// ray; false: shadow rays are wanted everywhere.
    virtual bool sunlit(const RayPacket& /*rays*/, const HitPacket& /*hits*/, std::int32_t /*body*/,
                        const Doubles& /*width_m*/, SunlitPacket& /*out*/) const {
        return false;
    }

    /// Mean squared slope, of the gradient of heights, of ground at the hits of `body` that is too fine for
    /// the surface that rays meet; other lanes 0. False: the surface has all, or the material's roughness
    /// stands for it.
    virtual bool unresolved_slopes(const HitPacket& /*hits*/, std::int32_t /*body*/,
                                   Doubles& /*squared*/) const {
        return false;
    }

    /// Texture coordinates (uv) at the hits of `body`, whose `surface` has been filled; false: the shape has
    /// no parametrisation of its own.
    virtual bool texture_coordinates(const HitPacket& /*hits*/, std::int32_t /*body*/,
                                     const SurfacePacket& /*surface*/, UvPacket& /*out*/) const {
        return false;
    }
    /// Material slot of a primitive: index into the materials of the shape.
    [[nodiscard]] virtual std::size_t material_slot(std::uint32_t /*primitive*/) const { return 0; }

    /// Area over which sample_area() is uniform, m2; 0: not supported.
    [[nodiscard]] virtual double sampled_area_m2() const { return 0; }
    /// Samples a point of that area, and the outer normal there, from u, v in [0,1).
    virtual void sample_area(double /*u*/, double /*v*/, Vec3& /*position*/, Vec3& /*normal*/) const {}

    /// Direction that slopes count from: up at a point of the surface, any length.
    [[nodiscard]] virtual Vec3 up(Vec3 position_m) const { return position_m; }

    /// Tiles that rays hold a SurfaceTiles::Pin of while they use a DetailView; null: none.
    [[nodiscard]] virtual const SurfaceTiles* tiles() const { return nullptr; }

    /// Whether hits may be doubtful, so that rays have a DetailView that counts these.
    [[nodiscard]] virtual bool counts_doubts() const { return false; }

    /// Lines on what was found when its files were read, for people.
    [[nodiscard]] virtual std::vector<std::string> notes() const { return {}; }
    /// Lines on what is probably wrong in them.
    [[nodiscard]] virtual std::vector<std::string> warnings() const { return {}; }

    /// Facets of the surface, by primitive; null: it is curved.
    [[nodiscard]] virtual const FacetSet* facets() const { return nullptr; }
};

} // namespace obscura::renderer
