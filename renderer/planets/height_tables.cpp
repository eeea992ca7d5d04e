// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/height_tables.hpp"

#include <fmt/format.h>

#include <array>
#include <numbers>
#include <string_view>

namespace obscura::renderer {
namespace {

using terrain::ProjectionKind;

constexpr double degree = std::numbers::pi / 180;
constexpr std::array cylindrical_keys{"left_deg", "right_deg", "top_deg", "bottom_deg"};
constexpr std::array corner_keys{"left_m", "top_m", "pixel_m"};

config::Keys keys_of(HeightTable& t) {
    const auto angle = [](std::string_view name, double& value) {
        return config::key(name, config::Scaled{&value, degree}).unit("deg");
    };
    return {
        config::key("file", config::Path{&t.file})
            .required()
            .help("Height map: a giant texture (.obt), or an image of at most 67 million pixels (PDS3 label, "
                  "TIFF, FITS, OpenEXR or PNG)"),
        config::key("priority", &t.priority)
            .range(-1000, 1000)
            .help("Maps of higher priority cover those of lower, of equal ones the later covers the earlier; "
                  "the lowest must cover the whole body without holes"),
        config::key("feather_m", &t.feather_m)
            .unit("m")
            .range(0, 1e9)
            .help("Width over which a map goes over to those below it at the edge of its data; 0: 16 of its "
                  "pixels and at least 4 of those below, at most a quarter of its shorter side"),
        config::key("match", &t.match)
            .help("How a map is fitted to those below it: not at all, or shifted by the mean difference"),
        config::key("scale_m", &t.map.scale_m)
            .unit("m")
            .range(1e-9, 1e9)
            .help("Length of the file's unit, where its label does not say that; the scale of a label is "
                  "applied before"),
        config::key("offset_m", &t.map.offset_m)
            .unit("m")
            .range(-1e12, 1e12)
            .help("Added to the numbers after the scale"),
        config::key("values", &t.map.meaning, "file")
            .help("What the numbers are: heights above the reference surface along the direction from the "
                  "centre (of a plane: along z) or along its normal, or distances from the centre; \"file\": "
                  "as "
                  "its label says, else heights"),
        config::key("projection", &t.map.projection, "file")
            .help("Projection of the map; \"file\": as its label says (PDS3, GeoTIFF, .obt)"),
        config::key("registration", &t.map.registration)
            .help(
                "Whether samples belong to the middles of pixels or to nodes, the outer of which lie on the "
                "edges; with projection"),
        config::key("latitudes", &t.map.latitudes)
            .help("Kind of the latitudes of the map, planetographic ones those of the spheroid of the body; "
                  "with "
                  "projection"),
        angle("left_deg", t.map.left_rad)
            .range(-720, 720)
            .help("Longitude of the left edge, east positive; with projection = \"simple_cylindrical\""),
        angle("right_deg", t.map.right_rad)
            .range(-720, 720)
            .help("Longitude of the right edge; less than that of the left one if columns run westwards"),
        angle("top_deg", t.map.top_rad).range(-90, 90).help("Latitude of the edge above the first row"),
        angle("bottom_deg", t.map.bottom_rad).range(-90, 90).help("Latitude of the edge below the last row"),
        angle("centre_longitude_deg", t.map.centre_longitude_rad)
            .range(-360, 360)
            .help("Meridian that runs up from the pole (south) or down from it (north) in a polar "
                  "stereographic "
                  "map, which has true scale at the pole"),
        config::key("left_m", &t.map.left_m)
            .unit("m")
            .range(-1e12, 1e12)
            .help("x of the left edge of a planar or polar stereographic map"),
        config::key("top_m", &t.map.top_m)
            .unit("m")
            .range(-1e12, 1e12)
            .help("y of the edge above its first row"),
        config::key("pixel_m", &t.map.pixel_m)
            .unit("m")
            .range(0, 1e9)
            .help("Edge of a pixel of a planar or polar stereographic map; wanted with one of those "
                  "projections"),
    };
}

/// Reports keys that the projection of the table does not have.
void check_projection(const HeightTable& t, const config::ReadTable& table) {
    const auto& kind = t.map.projection;
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
    if (kind && !cylindrical && !(t.map.pixel_m > 0))
        table.refuse("pixel_m", fmt::format("wanted above 0 with projection = \"{}\"", name_of(*kind)));
    if (cylindrical && !(t.map.left_rad != t.map.right_rad)) table.refuse("right_deg", "is left_deg");
    if (cylindrical && !(t.map.top_rad != t.map.bottom_rad)) table.refuse("bottom_deg", "is top_deg");
}

config::Section height_section(HeightTable& t) {
    config::Section section{"height", "A height map of a planet or terrain."};
    section.keys = keys_of(t);
    section.check = [&t](const config::ReadTable& table) { check_projection(t, table); };
    return section;
}

} // namespace

config::List height_list(std::vector<HeightTable>& tables) {
    return config::list<HeightTable>(
        "height",
        "A height map of a planet or terrain, one table for each: where they overlap, that "
        "of the higher priority covers the others and goes over to them at the edge of its "
        "data. Without any, the body has its reference surface.",
        tables, height_section);
}

std::string identity_of(const std::vector<HeightTable>& tables) {
    std::string text;
    for (HeightTable table : tables)
        text += config::print_keys(keys_of(table));
    return text;
}

std::vector<std::shared_ptr<const terrain::HeightLayer>> open_heights(const std::vector<HeightTable>& tables,
                                                                      const terrain::SurfaceDomain& domain,
                                                                      std::vector<std::string>& notes) {
    std::vector<terrain::HeightSource> sources;
    for (const HeightTable& table : tables) {
        terrain::HeightSource source;
        source.name = table.file;
        source.priority = table.priority;
        source.match = table.match;
        if (table.feather_m > 0) source.feather_m = table.feather_m;
        terrain::MapKeys map = table.map;
        map.file = table.file;
        source.raster = terrain::open_map(map, domain, notes);
        sources.push_back(std::move(source));
    }
    terrain::HeightStack stack = terrain::make_height_stack(domain, std::move(sources));
    for (const terrain::Overlap& overlap : stack.overlaps)
        notes.push_back(to_string(overlap));
    return std::move(stack.layers);
}

} // namespace obscura::renderer
