// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/planet_parameters.hpp"

#include "core/error.hpp"
#include "core/memory_budget.hpp"
#include "renderer/planets/terrain_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

constexpr double degree = std::numbers::pi / 180;

/// Heights of a whole-body map above the ellipsoid.
class MapLayer final : public terrain::HeightLayer {
public:
    MapLayer(HeightMap map, bool radius, Vec3 radii_m)
        : map_(std::move(map)),
          radius_(radius),
          least_radius_m_(std::min({radii_m.x, radii_m.y, radii_m.z})),
          largest_radius_m_(std::max({radii_m.x, radii_m.y, radii_m.z})) {}

    void apply(const terrain::VertexGrid& grid, std::span<double> heights_m,
               std::span<double> sample_spacings_m) const override {
        for (std::size_t k = 0; k < heights_m.size(); ++k) {
            const Vec3 p = grid.positions_m[k];
            heights_m[k] = radius_ ? map_.at(p) - length(p) : map_.at(p);
            sample_spacings_m[k] = sample_spacing_m(p);
        }
    }
    [[nodiscard]] terrain::HeightRange range(const terrain::Cap& cap, double /*spacing_m*/,
                                             terrain::HeightRange /*below*/) const override {
        // Two-dimensional cubics weigh samples with factors whose magnitudes add up to 1.25^2 at most.
        const double middle = (static_cast<double>(map_.least()) + static_cast<double>(map_.largest())) / 2;
        const double half =
            1.5625 / 2 * (static_cast<double>(map_.largest()) - static_cast<double>(map_.least()));
        const double centre_m = length(cap.centre_m);
        const double near_m = radius_ ? std::max(centre_m - cap.radius_m, least_radius_m_) : 0,
                     far_m = radius_ ? std::min(centre_m + cap.radius_m, largest_radius_m_) : 0;
        return {middle - half - far_m, middle + half - near_m, sample_spacing_m(cap.centre_m)};
    }
    [[nodiscard]] double sample_spacing_m(Vec3 position_m) const override {
        return std::numbers::pi * length(position_m) / map_.height();
    }

private:
    HeightMap map_;
    bool radius_;
    double least_radius_m_, largest_radius_m_;
};

/// Level whose faces have that many cells along their edge.
int level_of(std::uint32_t cells_per_face) {
    return std::bit_width(cells_per_face / terrain::tile_cells) - 1;
}

std::shared_ptr<const Shape> read_planet(const PlanetParameters& p) {
    HeightMap map = read_height_map(p.height_file, p.height_scale_m, p.left_longitude_rad);
    const double least_radius = std::min({p.radii_m.x, p.radii_m.y, p.radii_m.z});
    const bool radius = p.values == HeightMap::Values::radius;
    if (!radius && map.largest() > 0.5 * least_radius)
        throw InputError(fmt::format("{}: heights up to {:.6g} m on a body of radius {:.6g} m; if they are "
                                     "distances from the centre, set height_values = \"radius\"",
                                     p.height_file, map.largest(), least_radius));
    if (radius && map.least() < 0.1 * least_radius)
        throw InputError(
            fmt::format("{}: a distance from the centre of {:.6g} m on a body of radius {:.6g} m; "
                        "if these are heights, set height_values = \"height\"",
                        p.height_file, map.least(), least_radius));
    TerrainShape::Settings settings;
    settings.tiles.arena_bytes = std::uint64_t{p.tile_memory_mib} << 20;
    if (p.cells_per_face > 0) settings.fixed_level = level_of(p.cells_per_face);
    std::vector<std::shared_ptr<const terrain::HeightLayer>> layers{
        std::make_shared<MapLayer>(std::move(map), radius, p.radii_m)};
    try {
        return std::make_shared<TerrainShape>(terrain::SurfaceDomain::ellipsoid(p.radii_m), std::move(layers),
                                              settings);
    } catch (const InputError& error) {
        throw InputError(fmt::format("{}: {}", p.height_file, error.what()));
    }
}

} // namespace

scene::ParameterList declare(PlanetParameters& p) {
    return {
        config::key("radii_m", &p.radii_m)
            .unit("m")
            .range(1e-6, 1e12)
            .required()
            .help(
                "Three radii of the ellipsoid from which heights count, along x, y and z of the body frame"),
        config::key("height_file", config::Path{&p.height_file})
            .required()
            .help("Height map of the whole body by longitude and planetocentric latitude, twice as wide as "
                  "high, north up, east to the right: FITS, PDS3 label, TIFF, OpenEXR or PNG"),
        config::key("height_scale_m", &p.height_scale_m)
            .unit("m")
            .range(1e-9, 1e9)
            .help("Length of the height map's unit; the scaling factor of a PDS3 label is applied before"),
        config::key("height_values", &p.values)
            .help("What the numbers are: heights above the ellipsoid, or distances from the centre (PDS3 "
                  "labels "
                  "with the reference radius as OFFSET)"),
        config::key("height_left_deg", config::Scaled{&p.left_longitude_rad, degree})
            .unit("deg")
            .range(-360, 360)
            .help("Longitude of the height map's left edge, east positive"),
        config::key("cells_per_face", &p.cells_per_face)
            .range(0, most_cells_per_face)
            .help("Cells along the edge of each of the six faces of the surface, a power of two from 256; 0: "
                  "at "
                  "most half a pixel of the image wide wherever they are seen"),
        config::key("tile_memory_mib", &p.tile_memory_mib)
            .unit("MiB")
            .range(128, 16384)
            .help("Memory for tiles of the surface; those that were not used for long make room for others"),
    };
}

std::vector<scene::Conflict> conflicts_in(const PlanetParameters& p) {
    if (p.cells_per_face == 0 ||
        (p.cells_per_face >= terrain::tile_cells && std::has_single_bit(p.cells_per_face)))
        return {};
    return {{"cells_per_face", fmt::format("{}: allowed is 0 or a power of two from 256", p.cells_per_face)}};
}

std::shared_ptr<const Shape> make(const PlanetParameters& p, ShapeContext& context) {
    const std::string key =
        fmt::format("planet {} {} {} {} {} {} {} {} {}", p.height_file, p.radii_m.x, p.radii_m.y, p.radii_m.z,
                    p.height_scale_m, static_cast<int>(p.values), p.left_longitude_rad, p.cells_per_face,
                    p.tile_memory_mib);
    return context.shared(key, [&] { return read_planet(p); });
}

} // namespace obscura::renderer
