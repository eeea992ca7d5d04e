// SPDX-License-Identifier: Apache-2.0
// What shapes that are given by formulas for single rays have in common.
#pragma once

#include "renderer/shapes/shape.hpp"

namespace obscura::renderer {

/// Calls a formula for single rays, in double precision, whose origin has first been moved to where the ray
/// passes nearest to the body's own origin: so no precision is lost from any distance.
class AnalyticShape : public Shape {
public:
    /// Where a ray meets the surface.
    struct Crossing {
        double t = no_hit; ///< distance along the ray; may be negative
        std::uint32_t part = 0;
    };
    static constexpr std::size_t most_crossings = 4;
    struct Crossings {
        Crossing at[most_crossings];
        std::size_t count = 0;

        void add(double t, std::uint32_t part) {
            at[count] = {t, part};
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
    /// Outer unit normal at a point of a part.
    [[nodiscard]] virtual Vec3 normal(Vec3 point, std::uint32_t part) const = 0;
    /// Flat things are outside on both sides.
    [[nodiscard]] virtual bool has_inside() const { return true; }

private:
    /// The nearest crossing with 0 < t < limit.
    [[nodiscard]] Crossing nearest(Vec3 origin, Vec3 direction, double limit) const;

    double bounding_radius_m_;
};

} // namespace obscura::renderer
