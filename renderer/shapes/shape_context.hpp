// SPDX-License-Identifier: Apache-2.0
// Context for making shapes: Embree device and meshes that the bodies of one scene share.
#pragma once

#include "renderer/shapes/shape.hpp"

#include <functional>
#include <map>
#include <memory>
#include <string>

namespace obscura::renderer {

class EmbreeDevice;
struct TriangleMesh;

/// Passed to make() for each body in turn. Thread-bound.
class ShapeContext {
public:
    std::string place;  ///< the body, for messages
    bool emits = false; ///< the body emits light: its surface is sampled by area

    /// Makes a shape of triangles; all of them share one Embree device.
    [[nodiscard]] std::shared_ptr<const Shape> mesh_shape(TriangleMesh mesh);
    /// The shape that `make` returned for this `key`; calls it at the first request.
    [[nodiscard]] std::shared_ptr<const Shape>
    shared(const std::string& key, const std::function<std::shared_ptr<const Shape>()>& make);

private:
    std::shared_ptr<const EmbreeDevice> device_;
    std::map<std::string, std::shared_ptr<const Shape>> shapes_;
};

} // namespace obscura::renderer
