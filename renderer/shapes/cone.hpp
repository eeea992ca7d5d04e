// SPDX-License-Identifier: Apache-2.0
// Closed cylinder, cone or frustum along the z axis, the middle of its height at the origin.
#pragma once

#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/analytic_shape.hpp"
#include "renderer/shapes/shape_context.hpp"

namespace obscura::renderer {

/// Parameters of Cone.
struct ConeParameters {
    static constexpr std::string_view kind = "cone";
    static constexpr std::string_view help =
        "Closed cylinder, cone or frustum along z, the middle of its height at the origin.";
    using Family = scene::ShapeFamily;

    double bottom_radius_m = 1, top_radius_m = 1; ///< one of them may be 0
    double height_m = 1;
};
[[nodiscard]] scene::ParameterList declare(ConeParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const ConeParameters& p);
[[nodiscard]] std::shared_ptr<const Shape> make(const ConeParameters& p, ShapeContext& context);

class Cone final : public AnalyticShape {
public:
    explicit Cone(const ConeParameters& d);

protected:
    [[nodiscard]] Crossings crossings(Vec3 origin, Vec3 direction) const override;
    [[nodiscard]] Vec3 normal(Vec3 point, std::uint32_t face) const override;

private:
    double bottom_, top_, half_height_;
    double middle_, slope_; ///< radius = middle + slope z
};

} // namespace obscura::renderer
