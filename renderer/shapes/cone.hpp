// A closed cylinder, cone or frustum along the z axis, its middle at the origin.
#pragma once

#include "renderer/scene/scene.hpp"
#include "renderer/shapes/analytic_shape.hpp"

namespace obscura::renderer {

class Cone final : public AnalyticShape {
public:
    explicit Cone(const scene::Cone& d);

protected:
    [[nodiscard]] Crossings crossings(Vec3 origin, Vec3 direction) const override;
    [[nodiscard]] Vec3 normal(Vec3 point, std::uint32_t part) const override;

private:
    double bottom_, top_, half_height_;
    double middle_, slope_; ///< radius = middle + slope z
};

} // namespace obscura::renderer
