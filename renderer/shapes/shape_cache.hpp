// SPDX-License-Identifier: Apache-2.0
// Cache of shapes for renderers that are made one after the other of scenes that differ little.
#pragma once

#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape.hpp"

#include <map>
#include <memory>
#include <string>

namespace obscura::renderer {

class ShapeContext;

/// Shapes of the scene that was built last, by kind, parameters and files: a scene in which only poses or
/// materials are others need not build its meshes again. A file counts as the same if its size and time of
/// change are. Kinds with tables of their own (terrains, planets) are made anew. Thread-bound; the shapes are
/// immutable, so that renderers that have them need not care.
class ShapeCache {
public:
    /// What get() does not return until end_scene() is forgotten then.
    void begin_scene();
    /// The shape of an equal description that emits light alike, or else make_shape().
    [[nodiscard]] std::shared_ptr<const Shape> get(const scene::Shape& description, ShapeContext& context);
    void end_scene();

private:
    std::map<std::string, std::shared_ptr<const Shape>> last_, now_;
};

} // namespace obscura::renderer
