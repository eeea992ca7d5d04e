// SPDX-License-Identifier: Apache-2.0
// What the bodies of one scene share while their shapes are made: the Embree device, meshes of the same file.
#pragma once

#include "renderer/shapes/shape.hpp"

#include <functional>
#include <map>
#include <memory>
#include <string>

namespace obscura::renderer {

class EmbreeDevice;
struct TriangleMesh;

/// Handed to make() for every body in turn. Not thread-safe.
class ShapeContext {
public:
    std::string place;  ///< the body, for messages
    bool emits = false; ///< the body sends out light: points are drawn from its surface

    /// A shape of triangles; all of them share one Embree device.
    [[nodiscard]] std::shared_ptr<const Shape> mesh_shape(TriangleMesh mesh);
    /// What `make` returned for the same `key` before, or returns now.
    [[nodiscard]] std::shared_ptr<const Shape>
    shared(const std::string& key, const std::function<std::shared_ptr<const Shape>()>& make);

private:
    std::shared_ptr<const EmbreeDevice> device_;
    std::map<std::string, std::shared_ptr<const Shape>> shapes_;
};

} // namespace obscura::renderer
