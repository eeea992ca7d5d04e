// SPDX-License-Identifier: Apache-2.0
// Shape of flat convex polygons: rooms, targets, mock-ups.
#pragma once

#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape_context.hpp"

#include <memory>
#include <vector>

namespace obscura::renderer {

/// Faces of the body, each counter-clockwise seen from outside.
struct PolygonsParameters {
    static constexpr std::string_view kind = "polygons";
    static constexpr std::string_view help =
        "Flat convex polygons given corner by corner: rooms, targets, mock-ups.";
    using Family = scene::ShapeFamily;

    std::vector<std::vector<Vec3>> faces_m;
};
[[nodiscard]] scene::ParameterList declare(PolygonsParameters& p);
[[nodiscard]] std::shared_ptr<const Shape> make(const PolygonsParameters& p, ShapeContext& context);

} // namespace obscura::renderer
