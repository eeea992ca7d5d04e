// SPDX-License-Identifier: Apache-2.0
// Keys of a planet in a scene file and the shape that is made from them.
#pragma once

#include "core/geometry.hpp"
#include "core/text/enum_names.hpp"
#include "renderer/planets/albedo_tables.hpp"
#include "renderer/planets/detail_parameters.hpp"
#include "renderer/planets/height_tables.hpp"
#include "renderer/scene/kind.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/shapes/shape_context.hpp"
#include "terrain/surface_domain.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

namespace obscura::renderer {

constexpr std::uint32_t max_cells_per_face = std::uint32_t{1} << 20;

/// How rays find what of the Sun is seen from a terrain.
enum class SunVisibilityKind : std::uint8_t {
    traced, ///< by a shadow ray each
    tiles,  ///< from means that are kept with its tiles
};
constexpr auto enum_names(SunVisibilityKind /*type*/) {
    using Kind = SunVisibilityKind;
    return std::array{EnumName{Kind::traced, "traced"}, EnumName{Kind::tiles, "tiles"}};
}

/// Slopes of ground that is too fine for the cells of a terrain.
enum class UnresolvedSlopes : std::uint8_t {
    in_material, ///< the material's own roughness stands for them
    facets,      ///< the material is on facets of such slopes
};
constexpr auto enum_names(UnresolvedSlopes /*type*/) {
    using Slopes = UnresolvedSlopes;
    return std::array{EnumName{Slopes::in_material, "in_material"}, EnumName{Slopes::facets, "facets"}};
}

/// What planets and terrains have in common.
struct ReliefParameters {
    std::vector<HeightTable> heights;
    std::vector<AlbedoTable> albedos;
    DetailParameters detail;
    std::uint32_t cells_per_face = 0;    ///< 0: by distance
    double cell_px = 0.5;                ///< largest width of cells by distance
    std::uint32_t tile_memory_mib = 512; ///< of the arena of tiles
    SunVisibilityKind sun_visibility = SunVisibilityKind::traced;
    UnresolvedSlopes unresolved_slopes = UnresolvedSlopes::in_material;
};

/// Parameters of an ellipsoid with relief.
struct PlanetParameters {
    static constexpr std::string_view kind = "planet";
    static constexpr std::string_view help = "Ellipsoid with relief from height maps.";
    using Family = scene::ShapeFamily;

    Vec3 radii_m{1, 1, 1}; ///< semi-axes along x, y and z, from which heights count
    ReliefParameters relief;
};
[[nodiscard]] scene::ParameterList declare(PlanetParameters& p);
[[nodiscard]] config::Section tables_in(PlanetParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const PlanetParameters& p);
/// The surface that heights count from.
[[nodiscard]] terrain::SurfaceDomain domain_of(const PlanetParameters& p);
/// Bodies of the same files and settings share one shape. Throws InputError.
[[nodiscard]] std::shared_ptr<const Shape> make(const PlanetParameters& p, ShapeContext& context);

/// Parameters of a square of a plane with relief.
struct TerrainParameters {
    static constexpr std::string_view kind = "terrain";
    static constexpr std::string_view help =
        "Square of the plane z = 0 of the body frame with relief along z from height maps.";
    using Family = scene::ShapeFamily;

    double half_edge_m = 1; ///< x and y from -half_edge_m to half_edge_m
    ReliefParameters relief;
};
[[nodiscard]] scene::ParameterList declare(TerrainParameters& p);
[[nodiscard]] config::Section tables_in(TerrainParameters& p);
[[nodiscard]] std::vector<scene::Conflict> conflicts_in(const TerrainParameters& p);
[[nodiscard]] terrain::SurfaceDomain domain_of(const TerrainParameters& p);
[[nodiscard]] std::shared_ptr<const Shape> make(const TerrainParameters& p, ShapeContext& context);

} // namespace obscura::renderer
