// SPDX-License-Identifier: Apache-2.0
// Planet or moon: an ellipsoid with a global height map, traced in double precision.
#pragma once

#include "core/enum_names.hpp"
#include "renderer/planets/height_field.hpp"
#include "renderer/planets/height_map.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/shapes/shape_context.hpp"

#include <string>

namespace obscura::renderer {

constexpr auto enum_names(HeightMap::Values /*type*/) {
    using Values = HeightMap::Values;
    return std::array{EnumName{Values::height, "height"}, EnumName{Values::radius, "radius"}};
}

/// Parameters of Planet.
struct PlanetParameters {
    static constexpr std::string_view kind = "planet";
    static constexpr std::string_view help =
        "Ellipsoid with relief from a height map of the whole body in simple cylindrical projection.";
    using Family = scene::ShapeFamily;

    Vec3 radii_m{1, 1, 1}; ///< semi-axes along x, y and z, from which heights count
    std::string height_file;
    double height_scale_m = 1; ///< length of the file's unit
    HeightMap::Values values = HeightMap::Values::height;
    double left_longitude_rad = -3.141592653589793; ///< of the file's left edge
    std::uint32_t cells_per_face = 0;               ///< 0: from the file's width
};
[[nodiscard]] scene::ParameterList declare(PlanetParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const PlanetParameters& p);
/// Bodies of the same file and settings share one shape. Throws InputError.
[[nodiscard]] std::shared_ptr<const Shape> make(const PlanetParameters& p, ShapeContext& context);

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
