// SPDX-License-Identifier: Apache-2.0
// Base class of shapes that are intersected analytically, ray by ray.
#pragma once

#include "renderer/shapes/shape.hpp"

namespace obscura::renderer {

/// Intersects single rays by a formula in double precision, after moving each ray's origin to its point of
/// closest approach to the body's origin, so that precision does not depend on the distance.
class AnalyticShape : public Shape {
public:
    /// Intersection of a ray with the surface.
    struct Crossing {
        double t = no_hit; ///< distance along the ray; may be negative
        std::uint32_t face = 0;
    };
    static constexpr std::size_t max_crossings = 4;
    struct Crossings {
        Crossing at[max_crossings];
        std::size_t count = 0;

        void add(double t, std::uint32_t face) {
            at[count] = {t, face};
            ++count;
        }
    };

    [[nodiscard]] double bounding_radius_m() const override { return bounding_radius_m_; }
    [[nodiscard]] bool shadows_itself() const override { return false; }
    void intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const override;
    void occlude(RayPacket& rays) const override;
    void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                 SurfacePacket& out) const override;

protected:
    explicit AnalyticShape(double bounding_radius_m) : bounding_radius_m_(bounding_radius_m) {}

    /// All crossings of the line with the surface, in any order.
    [[nodiscard]] virtual Crossings crossings(Vec3 origin, Vec3 direction) const = 0;
    /// Outer unit normal at a point of a face.
    [[nodiscard]] virtual Vec3 normal(Vec3 point, std::uint32_t face) const = 0;
    /// False for flat shapes: both their sides are outside.
    [[nodiscard]] virtual bool has_inside() const { return true; }

private:
    /// The nearest crossing with 0 < t < limit, but for those through which a ray leaves the surface that it
    /// starts on; `origin_error_m`: see RayPacket.
    [[nodiscard]] Crossing nearest(Vec3 origin, Vec3 direction, double limit, double origin_error_m) const;
    [[nodiscard]] bool leaves(Vec3 origin, Vec3 direction, Crossing crossing, double origin_error_m) const;

    double bounding_radius_m_;
};

} // namespace obscura::renderer
