// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/albedo_tables.hpp"

#include "renderer/planets/map_keys.hpp"

#include <utility>

namespace obscura::renderer {
namespace {

config::Keys albedo_keys(AlbedoTable& t) {
    config::Keys keys{
        config::key("file", config::Path{&t.file})
            .required()
            .help(
                "Albedo map: a giant texture (.obt), or an image of at most 67 million pixels (PDS3 label, TIFF, FITS, PNG, JPEG or OpenEXR)"),
        config::key("priority", &t.priority)
            .range(-1000, 1000)
            .help(
                "Albedo maps of higher priority cover those of lower, of equal ones the later covers the earlier; "
                "where none is, the material has its own albedo"),
        config::key("feather_m", &t.feather_m)
            .unit("m")
            .range(0, 1e9)
            .help("Width over which an albedo map goes over to those below it at the edge of its data; "
                  "0: 16 of its pixels and at least 4 of those below, at most a quarter of its shorter side"),
        config::key("scale", &t.scale)
            .range(1e-9, 1e9)
            .help("Factor on the numbers of the albedo map, after their coding or the scale of a label"),
        config::key("coding", &t.coding)
            .help(
                "Coding of the numbers of an image: integers over full scale, or over what GeoTIFF tags say, and reals as they are; "
                "or sRGB (IEC 61966-2-1). A giant texture has its values as they are"),
    };
    for (config::Key& key : map_keys(t.map))
        keys.push_back(std::move(key));
    return keys;
}

config::Section albedo_section(AlbedoTable& t) {
    config::Section section{"albedo", "An albedo map of a planet or terrain."};
    section.keys = albedo_keys(t);
    section.check = [&t](const config::ReadTable& table) { check_map_keys(t.map, table); };
    return section;
}

} // namespace

config::List albedo_list(std::vector<AlbedoTable>& tables) {
    config::List list = config::list<AlbedoTable>(
        "albedo",
        "An albedo map of a planet or terrain, one table for each: a factor on the material's reflectance. "
        "Where maps overlap, that of the higher priority covers the others and goes over to them at the edge of its data.",
        tables, albedo_section);
    list.most = max_albedo_tables;
    return list;
}

std::string identity_of(const std::vector<AlbedoTable>& tables) {
    std::string text;
    for (AlbedoTable table : tables)
        text += config::print_keys(albedo_keys(table));
    return text;
}

} // namespace obscura::renderer
