// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/map_keys.hpp"

#include "core/units.hpp"

#include <fmt/format.h>

#include <array>
#include <string>
#include <string_view>

namespace obscura::renderer {
namespace {

using terrain::ProjectionKind;

constexpr std::array cylindrical_keys{"left_deg", "right_deg", "top_deg", "bottom_deg"};
constexpr std::array corner_keys{"left_m", "top_m", "pixel_m"};

} // namespace

config::Keys map_keys(terrain::MapKeys& map) {
    const auto angle = [](std::string_view name, double& value) {
        return config::key(name, config::Scaled{&value, degree}).unit("deg");
    };
    return {
        config::key("projection", &map.projection, "file")
            .help("Projection of the map; \"file\": as its label says (PDS3, GeoTIFF, .obt)"),
        config::key("registration", &map.registration)
            .help(
                "Whether samples belong to the middles of pixels or to nodes, the outer of which lie on the edges; "
                "with projection"),
        config::key("latitudes", &map.latitudes)
            .help(
                "Kind of the latitudes of the map, planetographic ones those of the spheroid of the body; with projection"),
        angle("left_deg", map.left_rad)
            .range(-720, 720)
            .help("Longitude of the left edge, east positive; with projection = \"simple_cylindrical\""),
        angle("right_deg", map.right_rad)
            .range(-720, 720)
            .help("Longitude of the right edge; less than that of the left one if columns run westwards"),
        angle("top_deg", map.top_rad).range(-90, 90).help("Latitude of the edge above the first row"),
        angle("bottom_deg", map.bottom_rad).range(-90, 90).help("Latitude of the edge below the last row"),
        angle("centre_longitude_deg", map.centre_longitude_rad)
            .range(-360, 360)
            .help(
                "Meridian that runs up from the pole (south) or down from it (north) in a polar stereographic map, which has true scale at the pole"),
        config::key("left_m", &map.left_m)
            .unit("m")
            .range(-1e12, 1e12)
            .help("x of the left edge of a planar or polar stereographic map"),
        config::key("top_m", &map.top_m)
            .unit("m")
            .range(-1e12, 1e12)
            .help("y of the edge above its first row"),
        config::key("pixel_m", &map.pixel_m)
            .unit("m")
            .range(0, 1e9)
            .help(
                "Edge of a pixel of a planar or polar stereographic map; wanted with one of those projections"),
    };
}

void check_map_keys(const terrain::MapKeys& map, const config::ReadTable& table) {
    const auto& kind = map.projection;
    const bool cylindrical = kind == ProjectionKind::simple_cylindrical;
    const bool polar = kind == ProjectionKind::north_polar_stereographic ||
                       kind == ProjectionKind::south_polar_stereographic;
    const std::string own = fmt::format("goes without projection = \"{}\"", kind ? name_of(*kind) : "file");
    for (const char* key : cylindrical_keys)
        if (table.has(key) && !cylindrical) table.refuse(key, own);
    for (const char* key : corner_keys)
        if (table.has(key) && (!kind || cylindrical)) table.refuse(key, own);
    if (table.has("centre_longitude_deg") && !polar) table.refuse("centre_longitude_deg", own);
    for (const char* key : {"registration", "latitudes"})
        if (table.has(key) && !kind) table.refuse(key, own);
    if (kind && !cylindrical && !(map.pixel_m > 0))
        table.refuse("pixel_m", fmt::format("wanted above 0 with projection = \"{}\"", name_of(*kind)));
    if (cylindrical && !(map.left_rad != map.right_rad)) table.refuse("right_deg", "is left_deg");
    if (cylindrical && !(map.top_rad != map.bottom_rad)) table.refuse("bottom_deg", "is top_deg");
}

} // namespace obscura::renderer
