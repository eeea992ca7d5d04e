// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/polygons.hpp"

#include "core/error.hpp"
#include "renderer/shapes/polygon_shape.hpp"

#include <fmt/format.h>

#include <cstddef>
#include <utility>
#include <vector>

namespace obscura::renderer {

scene::ParameterList declare(PolygonsParameters& p) {
    return {config::key("faces_m", config::Faces{&p.faces_m})
                .unit("m")
                .range(-1e12, 1e12)
                .required()
                .help("Flat convex faces of the body: corners counter-clockwise seen from outside")};
}

std::shared_ptr<const Shape> make(const PolygonsParameters& p, ShapeContext& context) {
    std::vector<TriangleCorners> triangles;
    for (std::size_t f = 0; f < p.faces_m.size(); ++f) {
        const std::vector<Vec3>& corners = p.faces_m[f];
        if (corners.size() < 3)
            throw ConfigError(
                fmt::format("{}: face {} has {} corners: at least 3", context.place, f + 1, corners.size()));
        for (std::size_t k = 2; k < corners.size(); ++k) {
            const TriangleCorners triangle{corners[0], corners[k - 1], corners[k]};
            // A smaller area has no direction even in double precision.
            if (length_squared(cross(triangle[1] - triangle[0], triangle[2] - triangle[0])) >= 1e-280)
                triangles.push_back(triangle);
        }
    }
    if (triangles.empty())
        throw InputError(fmt::format("{}: no face has an area: nothing could be seen", context.place));
    return std::make_shared<PolygonShape>(std::move(triangles), context.emits);
}

} // namespace obscura::renderer
