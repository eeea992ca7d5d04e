// SPDX-License-Identifier: Apache-2.0
// Triaxial ellipsoid, intersected analytically in double precision.
#pragma once

#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/shapes/shape_context.hpp"

namespace obscura::renderer {

/// Parameters of Ellipsoid.
struct EllipsoidParameters {
    static constexpr std::string_view kind = "ellipsoid";
    static constexpr std::string_view help = "Triaxial ellipsoid about the origin of the body frame.";
    using Family = scene::ShapeFamily;

    Vec3 radii_m{1, 1, 1}; ///< semi-axes along x, y and z
};
[[nodiscard]] scene::ParameterList declare(EllipsoidParameters& p);
[[nodiscard]] std::shared_ptr<const Shape> make(const EllipsoidParameters& p, ShapeContext& context);

/// Centre at the origin, semi-axes along the body's axes. Haines, Guenther, Akenine-Moeller, "Precision
/// Improvements for Ray/Sphere Intersection", Ray Tracing Gems (2019) ch. 7: the discriminant comes from the
/// point of closest approach, so that nothing cancels even from 1 au away.
class Ellipsoid final : public Shape {
public:
    explicit Ellipsoid(const EllipsoidParameters& description);

    [[nodiscard]] double bounding_radius_m() const override { return bounding_radius_m_; }
    [[nodiscard]] bool shadows_itself() const override { return false; }
    [[nodiscard]] Vec3 ellipsoid_radii_m() const override { return radii_m_; }
    void intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const override;
    void occlude(RayPacket& rays) const override;
    void surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                 SurfacePacket& out) const override;

private:
    /// See distances().
    [[nodiscard]] double slack(const RayPacket& rays) const;

    Vec3 radii_m_;
    Vec3 inverse_radii_;
    double bounding_radius_m_;
};

} // namespace obscura::renderer
