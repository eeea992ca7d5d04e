// SPDX-License-Identifier: Apache-2.0
// Commands that create objects, place them and ask for them.
#include "core/pose_range.hpp"
#include "core/text/printable.hpp"
#include "serve/compatible/handlers.hpp"
#include "serve/compatible/objects.hpp"
#include "serve/compatible/stand_ins.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace obscura::serve::compatible {
namespace {

using service::compatible::Fields;

Object& named(Request& r, std::string_view argument = "object_name") {
    return r.client_state.object(r.arguments.text(argument), r.command.name);
}

/// Adds the files of the textures diffuse, specular, emission, normal; missing and empty ones are white.
void add_textures(Request& r, Object& body) {
    nlohmann::json& keys = body.keys;
    const Value& given = r.arguments.value("textures");
    std::vector<std::string> names;
    if (const List* const list = given.as<List>())
        for (const Value& value : *list) {
            const auto* const name = value.as<std::string>();
            if (name == nullptr && value.as<std::monostate>() == nullptr)
                throw r.arguments.refused("textures", "holds what is no name", "names of files");
            names.push_back(name == nullptr ? "" : *name);
        }
    else if (const auto* const name = given.as<std::string>())
        names.push_back(*name);
    names.resize(texture_units);
    for (int unit = 0; unit < texture_units; ++unit)
        if (const std::string& name = names[static_cast<std::size_t>(unit)];
            r.client_state.textures.contains(name))
            body.worn_textures[unit] = name;
    if (!names[1].empty()) r.reply.warn("createBody: textures: a specular texture has no effect");
    for (const auto& [index, key] : {std::pair{0, "albedo_texture"}, std::pair{3, "normal_texture"}})
        if (const std::string& name = names[static_cast<std::size_t>(index)]; !name.empty())
            keys[key] = texture_key(r, name);
    // A material that shines has its picture in the light that it sends out.
    if (keys.contains("emission_w_m2_sr")) {
        if (keys.contains("albedo_texture")) keys["emission_texture"] = keys["albedo_texture"];
        keys.erase("albedo_texture");
    }
    if (names[2].empty()) return;
    keys["emission_texture"] = texture_key(r, names[2]);
    if (!keys.contains("emission_w_m2_sr")) keys["emission_w_m2_sr"] = {1.0, 1.0, 1.0, 1.0};
}

void create_body(Request& r) {
    const Model& shape = model_of(r, r.client_state.shapes, "shape_name");
    const Model& reflection = model_of(r, r.client_state.reflections, "brdf_name");
    const std::string& name = r.arguments.text("body_name");
    if (name == "camera") throw r.arguments.refused("body_name", "the camera is no body", "another name");
    Object body;
    body.placement = r.client_state.inherited_placement(name);
    if (name == "sun") {
        if (shape.radius_m < 1)
            throw r.arguments.refused("shape_name", "the Sun is a sphere", "of 1 m or more");
        body.kind = Object::Kind::sun;
        body.keys["radius_m"] = shape.radius_m;
    } else {
        body.keys = shape.keys;
        body.keys.update(reflection.keys);
        add_textures(r, body);
    }
    put(r.client_state.objects, r.arguments, "body_name", std::move(body));
}

void create_mesh(Request& r) {
    Object body;
    const std::string& name = r.arguments.text("object_name");
    if (name == "camera" || name == "sun")
        throw r.arguments.refused("object_name", "is no body", "another name");
    body.placement = r.client_state.inherited_placement(name);
    const double scale = r.arguments.number("scale", 1e-9, 1e12);
    const std::string& model = r.arguments.text("model_name");
    const auto file = r.client_state.files.find(model);
    if (const auto shape = file ? std::nullopt : stand_in_mesh(model)) {
        body.keys = *shape;
        r.reply.warn(fmt::format("{}: \"{}\" is not public and not here: a body made of noise instead",
                                 r.command.name, model));
    } else {
        body.keys = {{"shape", "mesh"},
                     {"file", (file ? *file : r.client_state.files.existing(model)).string()},
                     {"metres_per_unit", scale}};
    }
    body.keys["material"] = "lambert";
    body.keys["albedo"] = 1.0;
    put(r.client_state.objects, r.arguments, "object_name", std::move(body));
}

/// Keys of shapes stay, those of the material and its light are replaced.
void set_reflection(Request& r) {
    Object& object = named(r);
    const Model& reflection = model_of(r, r.client_state.reflections, "brdf");
    if (object.kind != Object::Kind::body)
        throw r.arguments.refused("object_name", "is no body", "a body or a mesh");
    require_whole(r, object);
    nlohmann::json kept = nlohmann::json::object();
    for (const char* key :
         {"shape", "half_edge_m", "height", "mean_radius_m", "axis_ratios", "radii_m", "file",
          "metres_per_unit", "albedo_texture", "normal_texture", "emission_texture", "smooth_normals"})
        if (object.keys.contains(key)) kept[key] = object.keys[key];
    kept.update(reflection.keys);
    // A relief has maps instead of the number, which is 1 with them.
    if (const auto maps = object.keys.find("albedo"); maps != object.keys.end() && maps->is_array())
        kept["albedo"] = *maps;
    object.keys = std::move(kept);
}

/// Transforms the surface of a whole object within the object's frame, whose place and attitude stay. The
/// element of all has none above it, so that its local transformation is its global one.
void set_transform(Request& r) {
    Object& object = named(r);
    require_whole(r, object);
    const auto refused = [&](const char* what) {
        return r.arguments.refused("matrix", what,
                                   "4 rows of 4 numbers: a rotation, and a translation up to 1e15 m");
    };
    const List* const rows = r.arguments.value("matrix").as<List>();
    if (rows == nullptr || rows->size() != 4) throw refused("is no list of 4 rows");
    std::array<std::vector<double>, 4> m;
    for (std::size_t i = 0; i < 4; ++i)
        if (!to_numbers((*rows)[i], m[i]) || m[i].size() != 4)
            throw refused("has a row that is not 4 numbers");
    constexpr double exact = 1e-6;
    Mat3 turn;
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            double product = 0;
            for (std::size_t k = 0; k < 3; ++k)
                product += m[i][k] * m[j][k];
            if (!(std::abs(product - (i == j ? 1 : 0)) <= exact))
                throw refused("turns with a scale, or a shear");
            turn.m[i][j] = m[i][j];
        }
    }
    if (refusal_of_position({m[0][3], m[1][3], m[2][3]})) throw refused("moves too far");
    const Vec3 x{m[0][0], m[1][0], m[2][0]}, y{m[0][1], m[1][1], m[2][1]}, z{m[0][2], m[1][2], m[2][2]};
    if (dot(cross(x, y), z) < 0) throw refused("is a reflection");
    if (m[3] != std::vector<double>{0, 0, 0, 1}) throw refused("has a last row other than 0, 0, 0, 1");
    object.placement.element =
        element_of({{m[0][3], m[1][3], m[2][3]}, from_matrix(turn)}, object.kind, r.client_state.conventions);
}

void set_motion(Request& r) {
    Object& object = named(r);
    const List* const pair = r.arguments.value("motion").as<List>();
    std::vector<double> velocity, rate;
    if (pair == nullptr || pair->size() != 2 || !to_numbers((*pair)[0], velocity) ||
        !to_numbers((*pair)[1], rate) || velocity.size() != 3 || rate.size() != 3)
        throw r.arguments.refused("motion", "is no pair of vectors", "[velocity, rotation rate]");
    if (refusal_of_velocity(vec3_of(velocity)) || refusal_of_rate(vec3_of(rate)))
        throw r.arguments.refused("motion", "is too fast, or not finite", "up to 1e9 m/s and 1e4 rad/s");
    object.placement.velocity_m_s = vec3_of(velocity);
    object.placement.rate_rad_s = vec3_of(rate);
}

} // namespace

const Model& model_of(Request& r, const std::map<std::string, Model>& all, std::string_view argument) {
    const std::string& name = r.arguments.text(argument);
    const auto found = all.find(name);
    if (found == all.end())
        throw r.arguments.refused(argument, fmt::format("nothing is called \"{}\"", printable(name, 60)),
                                  "one that was created before");
    return found->second;
}

void require_whole(Request& r, const Object& object) {
    if (!r.client_state.is_whole(object, r.arguments.text("element_name")))
        throw r.arguments.refused("element_name", "elements cannot be told apart",
                                  "the name of the object, or none");
}

std::string texture_file(Request& r, const std::string& name) {
    if (const auto named = r.client_state.textures.find(name); named != r.client_state.textures.end())
        return named->second.file;
    if (const auto found = r.client_state.files.find(name)) return found->string();
    if (!is_program_texture(name)) return r.client_state.files.existing(name).string();
    r.reply.warn(fmt::format("{}: \"{}\" is not public and not here: white instead", r.command.name, name));
    return {};
}

nlohmann::json texture_key(Request& r, const std::string& name) {
    const auto named = r.client_state.textures.find(name);
    return named != r.client_state.textures.end() ? key_of(named->second)
                                                  : nlohmann::json(texture_file(r, name));
}

void add_object_calls(Handlers& handlers) {
    handlers["reset"] = [](Request& r) { r.client_state.reset(); };
    handlers["createBody"] = create_body;
    handlers["createMesh"] = create_mesh;
    handlers["setObjectElementBRDF"] = set_reflection;
    handlers["exists"] = [](Request& r) {
        r.reply.set("exists", r.client_state.find(r.arguments.text("object_name")) != nullptr);
    };
    handlers["setAlias"] = [](Request& r) {
        (void)named(r);
        const std::string& name = r.arguments.text("object_name");
        const auto other = r.client_state.aliases.find(name);
        put(r.client_state.aliases, r.arguments, "alias",
            other != r.client_state.aliases.end() ? other->second : name);
    };
    handlers["setObjectPosition"] = [](Request& r) {
        const std::vector<double> to = r.arguments.vector("pos", 3);
        if (refusal_of_position(vec3_of(to)))
            throw r.arguments.refused("pos", "is too far away", "-1e15 to 1e15 m");
        named(r).placement.position_m = vec3_of(to);
    };
    handlers["getObjectPosition"] = [](Request& r) {
        r.reply.set("pos", list_of(named(r).placement.position_m));
    };
    handlers["setObjectAttitude"] = [](Request& r) {
        Object& object = named(r);
        const std::vector<double> to = r.arguments.vector("attitude", 4);
        if (std::all_of(to.begin(), to.end(), [](double v) { return v == 0; }))
            throw r.arguments.refused("attitude", "is a quaternion of length 0", "a rotation");
        object.placement.attitude = attitude_of(to, object.kind, r.client_state.conventions);
    };
    handlers["getObjectAttitude"] = [](Request& r) {
        r.reply.set("attitude", quaternion_of(named(r), r.client_state.conventions));
    };
    handlers["setObjectElementTransform"] = set_transform;
    handlers["setObjectMotion"] = set_motion;
    handlers["getObjectMotion"] = [](Request& r) {
        const Placement& p = named(r).placement;
        r.reply.set("motion", List{list_of(p.velocity_m_s), list_of(p.rate_rad_s)});
    };
    handlers["printObjectStructure"] = [](Request& r) {
        r.reply.set("object_structure", r.arguments.text("object_name") + ": " +
                                            r.client_state.files.without_folders(named(r).keys.dump(2)));
    };
}

} // namespace obscura::serve::compatible
