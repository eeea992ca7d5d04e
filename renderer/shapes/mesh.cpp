// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/mesh.hpp"

#include <fmt/format.h>

namespace obscura::renderer {

scene::ParameterList declare(MeshFileParameters& p) {
    return {
        config::key("file", config::Path{&p.path})
            .required()
            .help("Mesh file: OBJ, STL, PLY, 3DS, Collada, glTF, or PDS plate model (.tab, .plt)"),
        config::key("metres_per_unit", &p.metres_per_unit)
            .unit("m")
            .range(1e-9, 1e12)
            .help("Length of the mesh file's unit"),
        config::key("smooth_normals", &p.smooth_normals)
            .help("Use the mesh file's normals, or interpolated ones where it has none; false: flat facets"),
    };
}

std::shared_ptr<const Shape> make(const MeshFileParameters& p, ShapeContext& context) {
    const std::string key =
        fmt::format("{} {} {} {}", p.path, p.metres_per_unit, p.smooth_normals, context.emits);
    return context.shared(key, [&] { return context.mesh_shape(read_mesh_file(p)); });
}

} // namespace obscura::renderer
