// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/planet.hpp"

#include "core/error.hpp"
#include "core/memory_budget.hpp"

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

Planet::Planet(Vec3 radii_m, HeightField field)
    : inverse_radii_{1 / radii_m.x, 1 / radii_m.y, 1 / radii_m.z},
      field_(std::move(field)),
      bounding_radius_m_(std::max({radii_m.x, radii_m.y, radii_m.z}) * (1 + field_.largest()) * (1 + 1e-12)) {
}

void Planet::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    for (int i = 0; i < packet_size; ++i) {
        if (rays.active.on[i] == 0) continue;
        const HeightField::Crossing crossing = field_.first_crossing(
            scaled(rays.origin.lane(i)), scaled(rays.direction.lane(i)), std::min(rays.t_max[i], hits.t[i]));
        if (crossing.t == no_hit) continue;
        hits.t[i] = crossing.t;
        hits.body[i] = body;
        hits.primitive[i] = crossing.cell;
        hits.u[i] = static_cast<float>(crossing.s);
        hits.v[i] = static_cast<float>(crossing.r);
    }
}

void Planet::occlude(RayPacket& rays) const {
    for (int i = 0; i < packet_size; ++i)
        if (rays.active.on[i] != 0 &&
            field_.first_crossing(scaled(rays.origin.lane(i)), scaled(rays.direction.lane(i)), rays.t_max[i])
                    .t != no_hit)
            rays.active.on[i] = 0;
}

void Planet::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                     SurfacePacket& out) const {
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 direction = rays.direction.lane(i);
        const bool hit = hits.body[i] == body;
        const double t = hit ? hits.t[i] : 0.0;
        const Vec3 point = rays.origin.lane(i) + t * direction;
        const HeightField::Gradients gradients =
            field_.gradients(hit ? hits.primitive[i] : 0, static_cast<double>(hit ? hits.u[i] : 0.0F),
                             static_cast<double>(hit ? hits.v[i] : 0.0F));
        Vec3 facet = normalized(scaled(gradients.facet));
        Vec3 normal = normalized(scaled(gradients.smooth));
        const bool outside = dot(facet, direction) <= 0;
        if (!outside) {
            facet = -facet;
            normal = -normal;
        }
        out.position.set(i, point);
        out.normal.set(i, normal);
        out.facet_normal.set(i, facet);
        out.outside.on[i] = outside ? -1 : 0;
        // Secondary rays start clear of the rounding of the crossing, which is that of the body's size and of
        // the distance travelled so far.
        out.shadow_origin.set(i, point + (1e-10 * bounding_radius_m_ + 1e-13 * t) * facet);
    }
}

} // namespace obscura::renderer
