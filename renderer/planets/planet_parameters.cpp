// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/planet_parameters.hpp"

#include "core/io/memory_budget.hpp"
#include "renderer/planets/rock_forms.hpp"
#include "renderer/planets/terrain_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <utility>

namespace obscura::renderer {
namespace {

/// Level whose faces have that many cells along their edge.
int level_of(std::uint32_t cells_per_face) {
    return std::bit_width(cells_per_face / terrain::tile_cells) - 1;
}

/// Adds the keys of all kinds of relief.
scene::ParameterList with_keys(scene::ParameterList keys, ReliefParameters& relief) {
    keys.emplace_back(
        config::key("cells_per_face", &relief.cells_per_face)
            .range(0, max_cells_per_face)
            .help(
                "Cells along the edge of the plane or of each of the six faces of a planet, a power of two from 256; "
                "0: by distance, as `cell_px` says"));
    keys.emplace_back(
        config::key("cell_px", &relief.cell_px)
            .unit("px")
            .range(0.1, 8)
            .help("Largest width of the surface's cells in pixels of the image, wherever they are seen"));
    keys.emplace_back(
        config::key("tile_memory_mib", &relief.tile_memory_mib)
            .unit("MiB")
            .range(128, 16384)
            .help("Memory for tiles of the surface; those that were not used for long make room for others"));
    keys.emplace_back(
        config::key("sun_visibility", &relief.sun_visibility)
            .help(
                "How a terrain finds its own shadows: "
                "\"traced\", by a ray to the Sun from each point, exact; "
                "\"tiles\", from means over cells that are kept with its tiles and made again when the Sun has moved by 0.05 degrees: for frames of one sample a pixel at a fixed rate. "
                "In direct sunlight alone; reflections and lamps have shadow rays"));
    keys.emplace_back(
        config::key("unresolved_slopes", &relief.unresolved_slopes)
            .help(
                "Slopes of maps and detail that are too fine for the cells: "
                "\"in_material\", the material stands for them, as laws fitted to pictures from afar do; "
                "\"facets\", the light is that of facets with such slopes, some in the shadow of others, and the material that of ground finer than all detail"));
    return keys;
}

config::Section tables_of(ReliefParameters& relief) {
    config::Section section;
    section.lists.push_back(height_list(relief.heights));
    section.lists.push_back(albedo_list(relief.albedos));
    section.tables.push_back(detail_section(relief.detail));
    return section;
}

std::vector<scene::Conflict> conflicts_of(const ReliefParameters& relief) {
    const std::uint32_t cells = relief.cells_per_face;
    if (cells == 0 || (cells >= terrain::tile_cells && std::has_single_bit(cells))) return {};
    return {{"cells_per_face", fmt::format("{}: allowed is 0 or a power of two from 256", cells)}};
}

/// The reference surface as text.
std::string surface_of(const PlanetParameters& p) {
    return fmt::format("planet {} {} {}", p.radii_m.x, p.radii_m.y, p.radii_m.z);
}
std::string surface_of(const TerrainParameters& p) {
    return fmt::format("terrain {}", p.half_edge_m);
}

/// A dome fades in before it becomes a rock.
double rock_cells_of(const ReliefParameters& relief) {
    const double px = relief.detail.boulder_rock_px;
    return px > 0 ? std::max(px / relief.cell_px, terrain::Boulders::whole_cells) : 0;
}

/// The same for all bodies of a scene.
std::vector<std::shared_ptr<const Shape>> rock_forms(ShapeContext& context) {
    std::vector<std::shared_ptr<const Shape>> forms;
    for (TriangleMesh& mesh : make_rock_forms())
        forms.push_back(context.shared(fmt::format("rock {}", forms.size()),
                                       [&] { return context.mesh_shape(std::move(mesh)); }));
    return forms;
}

std::shared_ptr<const Shape> make_relief(const std::string& surface, const terrain::SurfaceDomain& domain,
                                         const ReliefParameters& relief, ShapeContext& context) {
    const bool sun_visibility = relief.sun_visibility == SunVisibilityKind::tiles;
    const std::string key = fmt::format(
        "{} {} {} {} {} {}\n{}\n{}", surface, relief.cells_per_face, relief.cell_px, relief.tile_memory_mib,
        name_of(relief.unresolved_slopes),
        // Visibility of the Sun belongs to one body.
        sun_visibility ? context.place : "", identity_of(relief.heights), identity_of(relief.detail));
    return context.shared(key, [&] {
        TerrainShape::Settings settings;
        settings.tiles.arena_bytes = std::uint64_t{relief.tile_memory_mib} << 20;
        settings.tiles.cell_px = relief.cell_px;
        require_memory(settings.tiles.arena_bytes, "tiles of a surface (tile_memory_mib)");
        settings.tiles.listed = {relief.detail.truth_least_px, relief.detail.truth_most};
        settings.tiles.sun_visibility = sun_visibility;
        settings.tiles.lost_slopes = relief.unresolved_slopes == UnresolvedSlopes::facets;
        if (relief.cells_per_face > 0) settings.fixed_level = level_of(relief.cells_per_face);
        std::vector<std::shared_ptr<const terrain::HeightLayer>> layers =
            open_heights(relief.heights, domain, settings.found);
        const double rock_cells = rock_cells_of(relief);
        const DetailLayers detail = make_detail(relief.detail, domain, !layers.empty(), rock_cells);
        layers.insert(layers.end(), detail.layers.begin(), detail.layers.end());
        if (detail.boulders && rock_cells > 0)
            settings.rocks = {rock_forms(context), rock_cells, relief.detail.boulder_least_m,
                              relief.detail.boulder_largest_m};
        return std::make_shared<TerrainShape>(domain, std::move(layers), settings);
    });
}

} // namespace

scene::ParameterList declare(PlanetParameters& p) {
    return with_keys(
        {config::key("radii_m", &p.radii_m)
             .unit("m")
             .range(1e-6, 1e12)
             .required()
             .help(
                 "Three radii of the ellipsoid from which heights count, along x, y and z of the body frame")},
        p.relief);
}

config::Section tables_in(PlanetParameters& p) {
    return tables_of(p.relief);
}

std::vector<scene::Conflict> conflicts_in(const PlanetParameters& p) {
    return conflicts_of(p.relief);
}

terrain::SurfaceDomain domain_of(const PlanetParameters& p) {
    return terrain::SurfaceDomain::ellipsoid(p.radii_m);
}

std::shared_ptr<const Shape> make(const PlanetParameters& p, ShapeContext& context) {
    return make_relief(surface_of(p), domain_of(p), p.relief, context);
}

scene::ParameterList declare(TerrainParameters& p) {
    return with_keys({config::key("half_edge_m", &p.half_edge_m)
                          .unit("m")
                          .range(1e-3, 1e9)
                          .required()
                          .help("Half of the edge of the square: x and y go from minus to plus this")},
                     p.relief);
}

config::Section tables_in(TerrainParameters& p) {
    return tables_of(p.relief);
}

std::vector<scene::Conflict> conflicts_in(const TerrainParameters& p) {
    return conflicts_of(p.relief);
}

terrain::SurfaceDomain domain_of(const TerrainParameters& p) {
    return terrain::SurfaceDomain::plane(p.half_edge_m);
}

std::shared_ptr<const Shape> make(const TerrainParameters& p, ShapeContext& context) {
    return make_relief(surface_of(p), domain_of(p), p.relief, context);
}

} // namespace obscura::renderer
