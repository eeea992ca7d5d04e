// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/polygons.hpp"

#include "core/error.hpp"
#include "renderer/mesh_files/triangle_mesh.hpp"

#include <fmt/format.h>

#include <cstdint>
#include <utility>

namespace obscura::renderer {

scene::ParameterList declare(PolygonsParameters& p) {
    return {config::key("faces_m", config::Faces{&p.faces_m})
                .unit("m")
                .range(-1e12, 1e12)
                .required()
                .help("Flat convex faces of the body: corners counter-clockwise seen from outside")};
}

std::shared_ptr<const Shape> make(const PolygonsParameters& p, ShapeContext& context) {
    TriangleMesh mesh;
    for (std::size_t f = 0; f < p.faces_m.size(); ++f) {
        const std::vector<Vec3>& corners = p.faces_m[f];
        if (corners.size() < 3)
            throw ConfigError(
                fmt::format("{}: face {} has {} corners: at least 3", context.place, f + 1, corners.size()));
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        for (const Vec3 c : corners)
            mesh.vertices.push_back(
                {static_cast<float>(c.x), static_cast<float>(c.y), static_cast<float>(c.z)});
        for (std::uint32_t k = 2; k < corners.size(); ++k)
            mesh.triangles.push_back({first, first + k - 1, first + k});
    }
    validate(mesh, context.place);
    return context.mesh_shape(std::move(mesh));
}

} // namespace obscura::renderer
