// SPDX-License-Identifier: Apache-2.0
// Keys of a planet in a scene file and the shape that is made from them.
#pragma once

#include "core/enum_names.hpp"
#include "core/geometry.hpp"
#include "renderer/planets/height_map.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape_context.hpp"

#include <memory>
#include <string>

namespace obscura::renderer {

constexpr auto enum_names(HeightMap::Values /*type*/) {
    using Values = HeightMap::Values;
    return std::array{EnumName{Values::height, "height"}, EnumName{Values::radius, "radius"}};
}

constexpr std::uint32_t most_cells_per_face = std::uint32_t{1} << 20;

/// Parameters of an ellipsoid with a height map.
struct PlanetParameters {
    static constexpr std::string_view kind = "planet";
    static constexpr std::string_view help =
        "Ellipsoid with relief from a height map of the whole body in simple cylindrical projection.";
    using Family = scene::ShapeFamily;

    Vec3 radii_m{1, 1, 1}; ///< semi-axes along x, y and z, from which heights count
    std::string height_file;
    double height_scale_m = 1; ///< length of the file's unit
    HeightMap::Values values = HeightMap::Values::height;
    double left_longitude_rad = -3.141592653589793; ///< of the file's left edge
    std::uint32_t cells_per_face = 0;               ///< 0: by distance
    std::uint32_t tile_memory_mib = 512;            ///< of the arena of tiles
};
[[nodiscard]] scene::ParameterList declare(PlanetParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const PlanetParameters& p);
/// Bodies of the same file and settings share one shape. Throws InputError.
[[nodiscard]] std::shared_ptr<const Shape> make(const PlanetParameters& p, ShapeContext& context);

} // namespace obscura::renderer
