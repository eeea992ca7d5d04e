// SPDX-License-Identifier: Apache-2.0
// Commands that make bodies of elevation models.
#include "core/error.hpp"
#include "core/io/path_state.hpp"
#include "images/image.hpp"
#include "serve/compatible/dem_file.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/objects.hpp"
#include "serve/compatible/stand_ins.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>

namespace obscura::serve::compatible {
namespace {

using nlohmann::json;
using service::compatible::Fields;

/// Keys that are answered even where the file does not have them.
constexpr std::array<std::pair<std::string_view, double>, 4> edges{{{"MINIMUM_LATITUDE", -90},
                                                                    {"MAXIMUM_LATITUDE", 90},
                                                                    {"WESTERNMOST_LONGITUDE", -180},
                                                                    {"EASTERNMOST_LONGITUDE", 180}}};

double required(const DemFile& dem, std::string_view key) {
    const auto number = dem.number(key);
    if (!number || !(*number > 0))
        throw InputError(dem.mistake(fmt::format("{}: a number above 0 is wanted", key)));
    return *number;
}

/// The height map stands beside the model, or where other files of the client do.
std::filesystem::path height_map(const Request& r, const std::filesystem::path& model,
                                 const std::string& name) {
    const std::filesystem::path beside = model.parent_path() / name;
    return r.client_state.files.existing(path_exists(beside) ? beside.string() : name);
}

/// Table [[body.height]]; null: the model has no height map.
json height_table(const Request& r, const DemFile& dem, const std::filesystem::path& model) {
    const std::string name = dem.text("HEIGHTMAP");
    if (name.empty()) return nullptr;
    if (dem.text("TYPE") == "CUBEMAP")
        throw InputError(dem.mistake(
            "TYPE: "
            "\"CUBEMAP\" is a private format, allowed SIMPLE_CYLINDRICAL, PLANAR, or none: as the label of the height map says"));
    json table{{"file", height_map(r, model, name).string()}};
    if (const auto scale = dem.number("SCALING_FACTOR")) table["scale_m"] = *scale;
    if (const auto offset = dem.number("OFFSET")) table["offset_m"] = *offset;
    return table;
}

/// What the client is told of the model: its keys, and the edges of the whole body for those it does not
/// have.
Fields info_of(const DemFile& dem, double radius_m) {
    Fields info;
    for (const auto& [key, value] : dem.keys())
        if (service::compatible::find(info, key) == nullptr)
            std::visit([&, &name = key](const auto& held) { info.push_back({name, held}); }, value);
    for (const auto& [key, value] : edges)
        if (service::compatible::find(info, key) == nullptr) info.push_back({std::string(key), value});
    if (service::compatible::find(info, "A_AXIS_RADIUS") == nullptr)
        info.push_back({"A_AXIS_RADIUS", radius_m});
    return info;
}

struct ModelFile {
    std::filesystem::path path;
    DemFile dem;
};

ModelFile read_model(Request& r) {
    const std::string& name = r.arguments.text("conemap_filename");
    const auto path = r.client_state.files.find(name);
    if (path) return {*path, DemFile::read(*path)};
    auto instead = stand_in_dem(name);
    if (!instead) return {r.client_state.files.existing(name), DemFile()};
    r.reply.warn(fmt::format("{}: \"{}\" is not public and not here: its reference surface instead",
                             r.command.name, name));
    return {{}, std::move(*instead)};
}

/// `maps`: tables of the albedo; null: none. The material's own is 1 with them.
void add_body(Request& r, json keys, json maps) {
    const std::string& name = r.arguments.text("object_name");
    if (name == "camera" || name == "sun")
        throw r.arguments.refused("object_name", "is no body", "another name");
    keys.update(model_of(r, r.client_state.reflections, "brdf_name").keys);
    if (!maps.is_null()) keys["albedo"] = std::move(maps);
    Object body;
    body.placement = r.client_state.inherited_placement(name);
    body.keys = std::move(keys);
    put(r.client_state.objects, r.arguments, "object_name", std::move(body));
}

std::string texture_of(Request& r) {
    const std::string& name = r.arguments.text("texture");
    return name.empty() ? std::string() : texture_file(r, name);
}

void create_spherical(Request& r) {
    const ModelFile model = read_model(r);
    const DemFile& dem = model.dem;
    const double a = required(dem, "A_AXIS_RADIUS");
    json keys{
        {"shape", "planet"},
        {"radii_m", {a, dem.number("B_AXIS_RADIUS").value_or(a), dem.number("C_AXIS_RADIUS").value_or(a)}}};
    if (json table = height_table(r, dem, model.path); !table.is_null()) {
        const std::string type = dem.text("TYPE");
        if (type == "SIMPLE_CYLINDRICAL") {
            table["projection"] = "simple_cylindrical";
            table["bottom_deg"] = dem.number(edges[0].first).value_or(edges[0].second);
            table["top_deg"] = dem.number(edges[1].first).value_or(edges[1].second);
            table["left_deg"] = dem.number(edges[2].first).value_or(edges[2].second);
            table["right_deg"] = dem.number(edges[3].first).value_or(edges[3].second);
        } else if (!type.empty()) {
            throw InputError(
                dem.mistake(fmt::format("TYPE: \"{}\", allowed SIMPLE_CYLINDRICAL, or none", type)));
        }
        keys["height"] = json::array({std::move(table)});
    }
    json maps;
    if (const std::string texture = texture_of(r); !texture.empty())
        maps = json::array({{{"file", texture}, {"projection", "simple_cylindrical"}}});
    add_body(r, std::move(keys), std::move(maps));
    r.reply.set("info", info_of(dem, a));
}

void create_planar(Request& r) {
    const ModelFile model = read_model(r);
    const DemFile& dem = model.dem;
    const double pixel_m = required(dem, "MAP_SCALE");
    const double width_m = required(dem, "LINE_SAMPLES") * pixel_m,
                 height_m = required(dem, "LINES") * pixel_m;
    // The largest square about the middle of the map.
    json keys{{"shape", "terrain"}, {"half_edge_m", std::min(width_m, height_m) / 2}};
    const auto place = [&](json& table, double own_pixel_m) {
        table["projection"] = "planar";
        table["left_m"] = -width_m / 2;
        table["top_m"] = height_m / 2;
        table["pixel_m"] = own_pixel_m;
    };
    if (json table = height_table(r, dem, model.path); !table.is_null()) {
        place(table, pixel_m);
        keys["height"] = json::array({std::move(table)});
    }
    json maps;
    if (const std::string texture = texture_of(r); !texture.empty()) {
        json table{{"file", texture}};
        place(table, width_m / images::read_image(texture).width);
        maps = json::array({std::move(table)});
    }
    add_body(r, std::move(keys), std::move(maps));
    r.reply.set("info", info_of(dem, dem.number("A_AXIS_RADIUS").value_or(0)));
}

} // namespace

void add_dem_calls(Handlers& handlers) {
    handlers["createSphericalDEM"] = create_spherical;
    handlers["createDEM"] = create_planar;
}

} // namespace obscura::serve::compatible
