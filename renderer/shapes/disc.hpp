// A disc or ring in the x-y plane, seen and lit from both sides.
#pragma once

#include "renderer/scene/scene.hpp"
#include "renderer/shapes/analytic_shape.hpp"

namespace obscura::renderer {

class Disc final : public AnalyticShape {
public:
    explicit Disc(const scene::Disc& d);

    /// u along the azimuth from +x towards +y, v from the inner edge to the outer one.
    bool chart(const HitPacket& hits, std::int32_t body, const SurfacePacket& surface,
               ChartPacket& out) const override;

protected:
    [[nodiscard]] Crossings crossings(Vec3 origin, Vec3 direction) const override;
    [[nodiscard]] Vec3 normal(Vec3 /*point*/, std::uint32_t /*part*/) const override { return {0, 0, 1}; }
    [[nodiscard]] bool has_inside() const override { return false; }

private:
    double outer2_, inner2_;
    double inner_m_, breadth_m_;
};

} // namespace obscura::renderer
