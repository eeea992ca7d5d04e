// SPDX-License-Identifier: Apache-2.0
#include "renderer/registries/registry.hpp"

#include "core/error.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/shapes/cone.hpp"
#include "renderer/shapes/disc.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/mesh.hpp"
#include "renderer/shapes/model_shape.hpp"
#include "renderer/shapes/polygons.hpp"
#include "renderer/shapes/procedural_body.hpp"

#include <fmt/format.h>

namespace obscura::renderer {
namespace {

/// The kind whose parameters are a P.
template<typename P>
ShapeKind shape() {
    ShapeKind kind{scene::kind_of<P>(),
                   [](const scene::Shape& d, ShapeContext& context) { return make(d.get<P>(), context); }};
    if constexpr (requires { P::own_material; }) kind.own_material = P::own_material;
    return kind;
}

} // namespace

const std::vector<ShapeKind>& shape_kinds() {
    // clang-format off
    static const std::vector<ShapeKind> kinds{
        shape<EllipsoidParameters>(),
        shape<MeshFileParameters>(),
        shape<PlanetParameters>(),
        shape<TerrainParameters>(),
        shape<ProceduralBodyParameters>(),
        shape<PolygonsParameters>(),
        shape<BoxParameters>(),
        shape<DiscParameters>(),
        shape<ConeParameters>(),
        shape<ModelShapeParameters>(),
    };
    // clang-format on
    return kinds;
}

std::shared_ptr<const Shape> make_shape(const scene::Shape& description, ShapeContext& context) {
    const ShapeKind* kind = find_kind(shape_kinds(), description.kind());
    if (kind == nullptr) throw ConfigError(fmt::format("{}: has no shape", context.place));
    check_description(*kind, description, context.place);
    return kind->make(description, context);
}

} // namespace obscura::renderer
