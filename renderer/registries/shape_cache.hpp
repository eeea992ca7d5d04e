// SPDX-License-Identifier: Apache-2.0
// Cache of shapes for renderers that are made one after the other of scenes that differ little.
#pragma once

#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

namespace obscura::renderer {

class ShapeContext;

/// What a body of the next scene will ask for.
struct WantedShape {
    const scene::Shape* description;
    bool emits; ///< see ShapeContext
};

/// Shapes of the scene that was built last, by kind, parameters, tables and files: a scene in which only
/// poses or materials are others need not build its meshes again, nor make the tiles of its planets and
/// terrains. A file counts as the same if its size and time of change are, and those of the data beside a PDS
/// label. Terrains that keep the Sun's visibility are made anew: their light depends on what was seen before.
/// Thread-bound; what rays meet of a shape does not depend on its use, so that renderers that have one need
/// not care.
class ShapeCache {
public:
    /// Forgets all shapes but these; then get() is called for each of them.
    void begin_scene(const std::vector<WantedShape>& wanted);
    /// The shape of an equal description that emits light alike, or else make_shape().
    [[nodiscard]] std::shared_ptr<const Shape> get(const scene::Shape& description, ShapeContext& context);

private:
    std::map<std::string, std::shared_ptr<const Shape>> shapes_;
};

} // namespace obscura::renderer
