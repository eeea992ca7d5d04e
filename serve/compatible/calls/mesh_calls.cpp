// SPDX-License-Identifier: Apache-2.0
// Commands that make one object of several mesh files, and that save a mesh.
#include "core/pose_range.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/merged_mesh.hpp"
#include "serve/compatible/objects.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

namespace obscura::serve::compatible {
namespace {

constexpr std::size_t max_triangles = 20'000'000;
constexpr double max_mesh_distance_m = max_position_m;

/// Vectors of `count` finite numbers; a single one stands for a list of one.
std::vector<std::vector<double>> rows_of(Request& r, std::string_view argument, std::size_t count) {
    const Value& value = r.arguments.value(argument);
    const List* const list = value.as<List>();
    std::vector<std::vector<double>> rows;
    const auto add = [&](const Value& row) {
        std::vector<double> numbers;
        if (!to_numbers(row, numbers) || numbers.size() != count ||
            !std::all_of(numbers.begin(), numbers.end(),
                         [](double v) { return std::abs(v) <= max_mesh_distance_m; }))
            throw r.arguments.refused(argument, fmt::format("row {} is none", rows.size()),
                                      fmt::format("rows of {} numbers", count));
        rows.push_back(std::move(numbers));
    };
    double number = 0;
    if (list != nullptr && !list->empty() && to_number(list->front(), number))
        add(value);
    else if (list != nullptr)
        for (const Value& row : *list)
            add(row);
    else
        throw r.arguments.refused(argument, "is no list", fmt::format("rows of {} numbers", count));
    return rows;
}

std::vector<std::string> names_of(Request& r) {
    const Value& value = r.arguments.value("mesh_names");
    std::vector<std::string> names;
    if (const auto* const one = value.as<std::string>()) names.push_back(*one);
    if (const List* const list = value.as<List>())
        for (const Value& row : *list)
            if (const auto* const name = row.as<std::string>()) names.push_back(*name);
    if (names.empty()) throw r.arguments.refused("mesh_names", "holds no names", "names of mesh files");
    return names;
}

/// The norm of a quaternion is a scale, in this command only.
std::vector<MeshPlace> places_of(Request& r) {
    const std::vector<std::string> names = names_of(r);
    const auto positions = rows_of(r, "positions", 3), attitudes = rows_of(r, "attitudes", 4);
    if (positions.size() != names.size() || attitudes.size() != names.size())
        throw r.arguments.refused("positions",
                                  fmt::format("{} places and {} attitudes of {} meshes", positions.size(),
                                              attitudes.size(), names.size()),
                                  "one for each mesh");
    std::vector<MeshPlace> places;
    for (std::size_t i = 0; i < names.size(); ++i) {
        const std::vector<double>& q = attitudes[i];
        const double scale = std::hypot(std::hypot(q[0], q[1]), std::hypot(q[2], q[3]));
        if (!(scale > 0))
            throw r.arguments.refused("attitudes", fmt::format("row {} is of length 0", i), "a rotation");
        places.push_back({r.client_state.files.existing(names[i]), vec3_of(positions[i]),
                          attitude_of(q, Object::Kind::body, r.client_state.conventions), scale});
    }
    return places;
}

void add_merged(Request& r, MeshMerger& merger, const std::vector<MeshPlace>& places) {
    const std::string& name = r.arguments.text("object_name");
    if (name == "camera" || name == "sun")
        throw r.arguments.refused("object_name", "is no body", "another name");
    Object body;
    body.placement = r.client_state.inherited_placement(name);
    if (const Object* const before = r.client_state.find(name))
        r.client_state.own.remove(before->keys.value("file", ""));
    body.keys = {{"shape", "mesh"},
                 {"file", r.client_state.own.write(".obj", merger.obj(places, max_triangles))},
                 {"material", "lambert"},
                 {"albedo", 1.0}};
    put(r.client_state.objects, r.arguments, "object_name", std::move(body));
}

/// Moves each mesh along the line through its place and the centre, which is a direction if its last number
/// is 0, to the surface there: towards the centre, or, if nothing is there, away from it.
void project(Request& r, MeshMerger& merger, std::vector<MeshPlace>& places) {
    const std::vector<double> centre = r.arguments.vector("projection_center", 4);
    const double ratio = r.arguments.number("offset_ratio", -1e6, 1e6);
    const Vec3 finite = centre[3] != 0 ? Vec3{centre[0], centre[1], centre[2]} / centre[3] : Vec3{};
    std::vector<renderer::Ray> rays;
    for (const MeshPlace& place : places) {
        const Vec3 along = centre[3] != 0 ? finite - place.position_m : Vec3{centre[0], centre[1], centre[2]};
        if (!(length(along) > 0) || !std::isfinite(length(along)))
            throw r.arguments.refused("projection_center", "is at the place of a mesh, or no direction",
                                      "elsewhere");
        rays.push_back({place.position_m, normalized(along)});
        rays.push_back({place.position_m, -normalized(along)});
    }
    const std::vector<double> distances = r.client_state.intersect(rays, r.work);
    std::size_t missed = 0;
    for (std::size_t i = 0; i < places.size(); ++i) {
        const Vec3 towards = rays[2 * i].direction;
        double along = distances[2 * i];
        if (!std::isfinite(along)) along = -distances[2 * i + 1];
        if (!std::isfinite(along)) {
            ++missed;
            continue;
        }
        const double offset_m = ratio * places[i].scale * merger.bounds(places[i].file).radius_m;
        places[i].position_m = places[i].position_m + towards * (along - offset_m);
    }
    if (missed > 0)
        r.reply.warn(fmt::format("{}: {} of {} meshes meet no surface, and stay where they are",
                                 r.command.name, missed, places.size()));
}

void save(Request& r) {
    const Object& object = r.client_state.object(r.arguments.text("object_name"), r.command.name);
    if (object.keys.value("shape", "") != "mesh")
        throw r.arguments.refused("object_name", "is no mesh", "an object that was made of mesh files");
    MeshMerger merger;
    const std::string file = object.keys.at("file").get<std::string>();
    const std::string text =
        merger.obj({{file, {}, {1, 0, 0, 0}, object.keys.value("metres_per_unit", 1.0)}}, max_triangles);
    std::ofstream out(r.client_state.files.place_for(r.arguments.text("filename")), std::ios::binary);
    out << text;
    out.close();
    if (!out) throw r.arguments.refused("filename", "cannot be written", {});
}

} // namespace

void add_mesh_calls(Handlers& handlers) {
    handlers["loadMultipleMeshes"] = [](Request& r) {
        MeshMerger merger;
        add_merged(r, merger, places_of(r));
    };
    handlers["loadAndProjectMultipleMeshes"] = [](Request& r) {
        MeshMerger merger;
        std::vector<MeshPlace> places = places_of(r);
        project(r, merger, places);
        add_merged(r, merger, places);
    };
    handlers["saveObject"] = save;
}

} // namespace obscura::serve::compatible
