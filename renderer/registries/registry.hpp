// SPDX-License-Identifier: Apache-2.0
// Registry of all kinds of shape: names, parameters and makers.
#pragma once

#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"
#include "renderer/shapes/shape_context.hpp"

#include <memory>
#include <string_view>
#include <vector>

namespace obscura::renderer {

/// One kind of shape.
struct ShapeKind : scene::Kind<scene::ShapeFamily> {
    std::shared_ptr<const Shape> (*make)(const scene::Shape& description, ShapeContext& context);
    /// Default material of a body of this shape that gives no albedo either; empty: the first kind of
    /// material.
    std::string_view own_material{};
};

/// All kinds in the order in which messages and the reference list them.
[[nodiscard]] const std::vector<ShapeKind>& shape_kinds();

/// Checks the description and makes its shape. Throws ConfigError or InputError that names `context.place`.
[[nodiscard]] std::shared_ptr<const Shape> make_shape(const scene::Shape& description, ShapeContext& context);

} // namespace obscura::renderer
