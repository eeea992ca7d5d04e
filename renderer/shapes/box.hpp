// SPDX-License-Identifier: Apache-2.0
// Axis-aligned box about the origin.
#pragma once

#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/analytic_shape.hpp"
#include "renderer/shapes/shape_context.hpp"

namespace obscura::renderer {

/// Parameters of Box.
struct BoxParameters {
    static constexpr std::string_view kind = "box";
    static constexpr std::string_view help = "Box about the origin of the body frame.";
    using Family = scene::ShapeFamily;

    Vec3 size_m{1, 1, 1};
};
[[nodiscard]] scene::ParameterList declare(BoxParameters& p);
[[nodiscard]] std::shared_ptr<const Shape> make(const BoxParameters& p, ShapeContext& context);

class Box final : public AnalyticShape {
public:
    explicit Box(const BoxParameters& d);

protected:
    [[nodiscard]] Crossings crossings(Vec3 origin, Vec3 direction) const override;
    [[nodiscard]] Vec3 normal(Vec3 point, std::uint32_t face) const override;

private:
    Vec3 half_;
};

} // namespace obscura::renderer
