// SPDX-License-Identifier: Apache-2.0
// Shape made from a mesh file.
#pragma once

#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/shapes/shape_context.hpp"

#include <memory>
#include <vector>

namespace obscura::renderer {

[[nodiscard]] scene::ParameterList declare(MeshFileParameters& p);
/// Bodies of the same file and settings share one shape, with one Embree scene. Throws InputError.
[[nodiscard]] std::shared_ptr<const Shape> make(const MeshFileParameters& p, ShapeContext& context);

} // namespace obscura::renderer
