// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/planet_parameters.hpp"

#include "core/error.hpp"
#include "core/memory_budget.hpp"
#include "renderer/planets/planet.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

constexpr double degree = std::numbers::pi / 180;

/// Finest grid that is chosen for a file; finer ones must be asked for.
constexpr std::uint32_t most_automatic_cells = 4096;

/// Cells of about half a pixel at the equator (a face spans a quarter of it): sampling the map's cubics so
/// costs about 20 m rms of 1.5 km relief at LDEM_4.
std::uint32_t automatic_cells(std::int32_t map_width) {
    return std::clamp(std::bit_ceil(static_cast<std::uint32_t>(map_width) / 2), 64u, most_automatic_cells);
}

std::shared_ptr<const Shape> read_planet(const PlanetParameters& p) {
    const HeightMap map = read_height_map(p.height_file, p.height_scale_m, p.left_longitude_rad);
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
    const std::uint32_t cells = p.cells_per_face > 0 ? p.cells_per_face : automatic_cells(map.width());
    require_memory(HeightField::bytes(cells), p.height_file);
    const auto height = [&](Vec3 direction) {
        const Vec3 base{direction.x * p.radii_m.x, direction.y * p.radii_m.y, direction.z * p.radii_m.z};
        const double base_m = length(base);
        return (radius ? map.at(base) - base_m : map.at(base)) / base_m;
    };
    try {
        return std::make_shared<Planet>(p.radii_m, HeightField(cells, height));
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
            .range(0, HeightField::most_cells_per_edge)
            .help(
                "Cells along the edge of each of the six faces of the surface, a power of two; 0: about two "
                "per pixel of the height map, at most 4096"),
    };
}

std::vector<scene::Conflict> conflicts_in(const PlanetParameters& p) {
    if (p.cells_per_face == 0 || (p.cells_per_face >= 2 && std::has_single_bit(p.cells_per_face))) return {};
    return {{"cells_per_face", fmt::format("{}: allowed is 0 or a power of two from 2", p.cells_per_face)}};
}

std::shared_ptr<const Shape> make(const PlanetParameters& p, ShapeContext& context) {
    const std::string key =
        fmt::format("planet {} {} {} {} {} {} {} {}", p.height_file, p.radii_m.x, p.radii_m.y, p.radii_m.z,
                    p.height_scale_m, static_cast<int>(p.values), p.left_longitude_rad, p.cells_per_face);
    return context.shared(key, [&] { return read_planet(p); });
}

} // namespace obscura::renderer
