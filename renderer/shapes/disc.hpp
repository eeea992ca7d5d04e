// SPDX-License-Identifier: Apache-2.0
// Disc or ring in the x-y plane, seen and lit from both sides.
#pragma once

#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/analytic_shape.hpp"
#include "renderer/shapes/shape_context.hpp"

namespace obscura::renderer {

/// Parameters of Disc.
struct DiscParameters {
    static constexpr std::string_view kind = "disc";
    static constexpr std::string_view help =
        "Disc or ring in the x-y plane about the origin, seen and lit from both sides.";
    using Family = scene::ShapeFamily;

    double radius_m = 1, inner_radius_m = 0;
};
[[nodiscard]] scene::ParameterList declare(DiscParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const DiscParameters& p);
[[nodiscard]] std::shared_ptr<const Shape> make(const DiscParameters& p, ShapeContext& context);

class Disc final : public AnalyticShape {
public:
    explicit Disc(const DiscParameters& d);

    /// u along the azimuth from +x towards +y, v from the inner edge to the outer one.
    bool texture_coordinates(const HitPacket& hits, std::int32_t body, const SurfacePacket& surface,
                             UvPacket& out) const override;

protected:
    [[nodiscard]] Crossings crossings(Vec3 origin, Vec3 direction) const override;
    [[nodiscard]] Vec3 normal(Vec3 /*point*/, std::uint32_t /*face*/) const override { return {0, 0, 1}; }
    [[nodiscard]] bool has_inside() const override { return false; }

private:
    double outer2_, inner2_;
    double inner_m_, breadth_m_;
};

} // namespace obscura::renderer
