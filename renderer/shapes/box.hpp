// A box about the origin.
#pragma once

#include "renderer/scene/scene.hpp"
#include "renderer/shapes/analytic_shape.hpp"

namespace obscura::renderer {

class Box final : public AnalyticShape {
public:
    explicit Box(const scene::Box& d);

protected:
    [[nodiscard]] Crossings crossings(Vec3 origin, Vec3 direction) const override;
    [[nodiscard]] Vec3 normal(Vec3 point, std::uint32_t part) const override;

private:
    Vec3 half_;
};

} // namespace obscura::renderer
