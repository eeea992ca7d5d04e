// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/height_tables.hpp"

#include "renderer/planets/map_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace obscura::renderer {
namespace {

config::Keys height_keys(HeightTable& t) {
    config::Keys keys{
        config::key("file", config::Path{&t.file})
            .required()
            .help(
                "Height map: a giant texture (.obt), or an image of at most 67 million pixels (PDS3 label, TIFF, FITS, OpenEXR or PNG)"),
        config::key("priority", &t.priority)
            .range(-1000, 1000)
            .help("Maps of higher priority cover those of lower, of equal ones the later covers the earlier; "
                  "the lowest must cover the whole body without holes"),
        config::key("feather_m", &t.feather_m)
            .unit("m")
            .range(0, 1e9)
            .help("Width over which a map goes over to those below it at the edge of its data; "
                  "0: 16 of its pixels and at least 4 of those below, at most a quarter of its shorter side"),
        config::key("match", &t.match)
            .help("How a map is fitted to those below it: not at all, or shifted by the mean difference"),
        config::key("scale_m", &t.map.scale_m)
            .unit("m")
            .range(1e-9, 1e9)
            .help(
                "Length of the file's unit, where its label does not say that; the scale of a label is applied before"),
        config::key("offset_m", &t.map.offset_m)
            .unit("m")
            .range(-1e12, 1e12)
            .help("Added to the numbers after the scale"),
        config::key("values", &t.map.meaning, "file")
            .help(
                "What the numbers are: heights above the reference surface along the direction from the centre (of a plane: along z) or along its normal, or distances from the centre; "
                "\"file\": as its label says, else heights"),
    };
    for (config::Key& key : map_keys(t.map))
        keys.push_back(std::move(key));
    return keys;
}

config::Section height_section(HeightTable& t) {
    config::Section section{"height", "A height map of a planet or terrain."};
    section.keys = height_keys(t);
    section.check = [&t](const config::ReadTable& table) { check_map_keys(t.map, table); };
    return section;
}

/// Says of maps that fit the first one that covers the whole body, turned by half a turn only.
void warn_of_half_turns(const terrain::SurfaceDomain& domain,
                        const std::vector<terrain::HeightSource>& sources, terrain::MapFindings& found) {
    const auto whole = std::find_if(sources.begin(), sources.end(),
                                    [](const auto& source) { return source.raster.raster->whole(); });
    for (const terrain::HeightSource& source : sources)
        if (whole != sources.end() && &source != &*whole &&
            fits_half_a_turn_away(domain, source.raster, whole->raster))
            found.warnings.push_back(fmt::format(
                "{}: its ground is that of {} half a turn away: one counts longitudes from 0 to 360 degrees, the other from -180 to 180. "
                "Check left_deg and right_deg of both",
                source.name, whole->name));
}

} // namespace

config::List height_list(std::vector<HeightTable>& tables) {
    return config::list<HeightTable>(
        "height",
        "A height map of a planet or terrain, one table for each: where they overlap, that of the higher priority covers the others and goes over to them at the edge of its data. "
        "Without any, the body has its reference surface.",
        tables, height_section);
}

std::string identity_of(const std::vector<HeightTable>& tables) {
    std::string text;
    for (HeightTable table : tables)
        text += config::print_keys(height_keys(table));
    return text;
}

std::vector<std::shared_ptr<const terrain::HeightLayer>> open_heights(const std::vector<HeightTable>& tables,
                                                                      const terrain::SurfaceDomain& domain,
                                                                      terrain::MapFindings& found) {
    std::vector<terrain::HeightSource> sources;
    for (const HeightTable& table : tables) {
        terrain::HeightSource source;
        source.name = table.file;
        source.priority = table.priority;
        source.match = table.match;
        if (table.feather_m > 0) source.feather_m = table.feather_m;
        terrain::MapKeys map = table.map;
        map.file = table.file;
        source.raster = terrain::open_map(map, domain, found);
        sources.push_back(std::move(source));
    }
    warn_of_half_turns(domain, sources, found);
    terrain::HeightStack stack = terrain::make_height_stack(domain, std::move(sources));
    for (const terrain::Overlap& overlap : stack.overlaps)
        found.notes.push_back(to_string(overlap));
    return std::move(stack.layers);
}

} // namespace obscura::renderer
