// SPDX-License-Identifier: Apache-2.0
// Planet or moon: an ellipsoid with a global height map, traced in double precision.
#pragma once

#include "renderer/planets/height_field.hpp"
#include "renderer/shapes/shape.hpp"

namespace obscura::renderer {

/// Centre at the origin, z towards the north pole, x at longitude 0 on the equator. Space is scaled by the
/// radii to the unit sphere of a HeightField. Shading normals are continuous.
class Planet final : public Shape {
public:
    Planet(Vec3 radii_m, HeightField field);

    [[nodiscard]] double bounding_radius_m() const override { return bounding_radius_m_; }
    [[nodiscard]] bool shadows_itself() const override { return true; }
    void intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const override;
    void occlude(RayPacket& rays) const override;
    void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                 SurfacePacket& out) const override;

    [[nodiscard]] const HeightField& field() const { return field_; }

private:
    [[nodiscard]] Vec3 scaled(Vec3 p) const {
        return {p.x * inverse_radii_.x, p.y * inverse_radii_.y, p.z * inverse_radii_.z};
    }

    Vec3 inverse_radii_;
    HeightField field_;
    double bounding_radius_m_;
};

} // namespace obscura::renderer
