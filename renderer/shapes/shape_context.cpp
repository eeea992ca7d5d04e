// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/shape_context.hpp"

#include "renderer/shapes/mesh_shape.hpp"

#include <utility>

namespace obscura::renderer {

std::shared_ptr<const Shape> ShapeContext::mesh_shape(TriangleMesh mesh) {
    if (!device_) device_ = std::make_shared<const EmbreeDevice>();
    return std::make_shared<MeshShape>(device_, std::move(mesh), emits);
}

std::shared_ptr<const Shape> ShapeContext::shared(const std::string& key,
                                                  const std::function<std::shared_ptr<const Shape>()>& make) {
    std::shared_ptr<const Shape>& shape = shapes_[key];
    if (!shape) shape = make();
    return shape;
}

} // namespace obscura::renderer
