// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/body_section.hpp"

#include "renderer/materials/model_material.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/registries/registry.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene_files/kernel_keys.hpp"
#include "renderer/scene_files/model_table.hpp"
#include "renderer/scene_files/parameter_texture.hpp"
#include "renderer/scene_files/place_keys.hpp"
#include "renderer/scene_files/section_rules.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/model_shape.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <iterator>
#include <string>
#include <utility>

namespace obscura::scene {
namespace {

using renderer::material_kinds;
using renderer::MaterialKind;
using renderer::shape_kinds;
using renderer::ShapeKind;

/// Values of the keys of a body that are no members of Body.
struct BodyKeys {
    std::string shape, material;
    std::vector<SpectralPoint> colour_curve;
    double normal_albedo = 0;
    JointKeys joint;
    PlaceKeys place;
    KernelPlaceKeys kernel;
    std::vector<ParameterTexture> textures;
};

/// Keys that every body has.
config::Keys common_keys(Body& body, BodyKeys& read) {
    config::Keys keys = keys_of(body);
    keys.push_back(config::key("shape", &read.shape)
                       .choices(names_of(shape_kinds()))
                       .required()
                       .help("Kind of the body's shape, which has keys of its own"));
    keys.push_back(
        config::key("material", &read.material)
            .choices(names_of(material_kinds()))
            .help(
                "Scattering law of the body's surface, or a real surface by name; each has keys of its own"));
    keys.push_back(
        config::key("colour_curve", config::Curve{&read.colour_curve})
            .range(0, 100)
            .help(
                "Factor on the body's reflectance over wavelength, pairs of nm and factor, averaged over the sunlight in each spectral band; "
                "instead of colour"));
    for (const config::Keys& more :
         {body_place_keys(read.place), keys_of(read.joint), keys_of(read.kernel, false)})
        keys.insert(keys.end(), more.begin(), more.end());
    return keys;
}

/// The albedo of a law that has one, which the reflectance is proportional to; null: it has none.
double* albedo_of(const ParameterList& parameters) {
    const auto found = std::find_if(parameters.begin(), parameters.end(),
                                    [](const Parameter& p) { return p.key.name == "albedo"; });
    return found == parameters.end() ? nullptr : *std::get_if<double*>(&found->key.target);
}

constexpr std::string_view material_name = "material", shape_name = "shape";
constexpr std::string_view normal_albedo_name = "normal_albedo";

/// Key of every law that has an albedo.
config::Key normal_albedo_key(double& value) {
    return config::key(normal_albedo_name, &value)
        .range(0, 1)
        .help("Normal albedo: radiance factor I/F lit and seen along the normal; instead of albedo");
}

/// `key` as an optional key.
config::Key optional(const config::Key& key) {
    return config::key(key.name, key.target)
        .unit(key.unit())
        .range(key.range())
        .choices(key.choices())
        .help(key.help());
}

/// The kind that the value at `key` of `table` selects, or else `fallback`; null if the value is invalid.
template<typename K>
const K* chosen(const config::Value& table, std::string_view key, const std::vector<K>& kinds,
                const K* fallback) {
    const config::Member* member = table.find(key);
    if (member == nullptr) return fallback;
    return member->value.kind == config::Value::Kind::string ? find_kind(kinds, member->value.string)
                                                             : nullptr;
}

/// Whether the value at `key` of `table` is the table of a model.
bool is_model(const config::Value& table, std::string_view key) {
    const config::Member* const member = table.find(key);
    return member != nullptr && member->value.kind == config::Value::Kind::table;
}

/// Whether the section has a table or a list called `name`.
bool has_table(const config::Section& section, std::string_view name) {
    const auto called = [&](const auto& inner) { return inner.name == name; };
    return std::any_of(section.tables.begin(), section.tables.end(), called) ||
           std::any_of(section.lists.begin(), section.lists.end(), called);
}

/// Whether the value is a table or a list of tables.
bool is_tables(const config::Value& value) {
    using Kind = config::Value::Kind;
    return value.kind == Kind::table ||
           (value.kind == Kind::array && !value.items.empty() && value.items.front().kind == Kind::table);
}

/// Names of the kinds that have `key`, or, if `tables`, a table of that name; of materials the laws, not the
/// presets.
template<typename K>
std::vector<std::string_view> kinds_with(const std::vector<K>& kinds, std::string_view key, bool tables) {
    std::vector<std::string_view> names;
    for (const K& kind : kinds) {
        if constexpr (requires { kind.preset; })
            if (kind.preset) continue;
        auto description = kind.make_default();
        for (const Parameter& p : kind.parameters(description))
            if (p.key.name == key || (p.key.name == "albedo" && key == normal_albedo_name))
                names.push_back(kind.name);
        if (tables && has_table(kind.tables(description), key)) names.push_back(kind.name);
    }
    return names;
}

/// Key of `table` that belongs to a kind other than the selected one, and would be ignored.
struct Stranger {
    const config::Member* member;
    std::string what;
};

/// Whether `keys` has a key called `name`.
bool has(const config::Keys& keys, std::string_view name) {
    return std::any_of(keys.begin(), keys.end(), [&](const config::Key& k) { return k.name == name; });
}

std::vector<Stranger> strangers_in(const config::Value& table, const config::Section& known,
                                   const ShapeKind& shape, const MaterialKind& material) {
    std::vector<Stranger> strangers;
    for (const config::Member& member : table.members) {
        if (has(known.keys, member.key) || has_table(known, member.key)) continue;
        const auto try_kinds = [&](const auto& kinds, std::string_view what, const auto& own, bool tables) {
            const std::vector<std::string_view> owners = kinds_with(kinds, member.key, tables);
            if (owners.empty()) return false;
            strangers.push_back({&member, fmt::format("belongs to {} = \"{}\", this body's is \"{}\"", what,
                                                      fmt::join(owners, "\" or \""), own.name)});
            return true;
        };
        // A value that is no table is first taken for a key.
        for (const bool tables : {is_tables(member.value), true})
            if (try_kinds(shape_kinds(), "shape", shape, tables) ||
                try_kinds(material_kinds(), "material", material, tables))
                break;
    }
    return strangers;
}

constexpr std::string_view ephemeris_name = "ephemeris";
constexpr std::string_view radii_name = "radii_m";

/// Whether a body of kind `shape` has the radii that the kernels have of it.
bool has_kernel_radii(const config::Value& table, const ShapeKind& shape) {
    return table.find(ephemeris_name) != nullptr && shape.name == renderer::EllipsoidParameters::kind &&
           table.find(radii_name) == nullptr;
}

constexpr std::string_view albedo_name = "albedo";

/// Whether the table gives tables [[body.albedo]], rather than a number or nothing.
bool has_albedo_tables(const config::Value& table) {
    const config::Member* const member = table.find(albedo_name);
    return member != nullptr && member->value.kind == config::Value::Kind::array && is_tables(member->value);
}

/// Adds the keys of the kinds of shape and material to `section`.
void add_kinds(config::Section& section, Body& body, BodyKeys& read, const ShapeKind& shape,
               const MaterialKind& material, const config::Value& table) {
    body.shape = shape.make_default();
    body.material = material.make_default();
    const bool kernel_radii = has_kernel_radii(table, shape);
    for (const Parameter& p : shape.parameters(body.shape))
        section.keys.push_back(kernel_radii && p.key.name == radii_name ? optional(p.key) : p.key);
    config::Section inside = shape.tables(body.shape);
    section.tables = std::move(inside.tables);
    section.lists = std::move(inside.lists);
    // "albedo" is a number of the law, or tables of maps of that number: the law's own is 1 then.
    const bool maps = has_albedo_tables(table) && has_table(section, albedo_name);
    if (!maps) std::erase_if(section.lists, [](const config::List& l) { return l.name == albedo_name; });
    const ParameterList parameters = material.parameters(body.material);
    read.textures = textures_of(parameters);
    for (const Parameter& p : parameters) {
        if (maps && p.key.name == albedo_name) {
            *albedo_of(parameters) = 1;
            continue;
        }
        const bool by_image = std::any_of(read.textures.begin(), read.textures.end(), [&](const auto& t) {
            const config::Member* file = table.find(t.file_key);
            return t.constant_key == p.key.name && file != nullptr &&
                   (!file->value.string.empty() || file->value.kind == config::Value::Kind::table);
        });
        const bool by_normal_albedo = p.key.name == "albedo" && table.find(normal_albedo_name) != nullptr;
        section.keys.push_back(material.preset || by_image || by_normal_albedo ? optional(p.key) : p.key);
    }
    if (albedo_of(parameters) != nullptr) section.keys.push_back(normal_albedo_key(read.normal_albedo));
    const config::Keys textures = texture_keys(read.textures);
    section.keys.insert(section.keys.end(), textures.begin(), textures.end());
}

/// Sets the albedo of the material by its normal albedo, if that is given.
void apply_normal_albedo(Body& body, double wanted, const config::ReadTable& table) {
    if (!table.has(normal_albedo_name)) return;
    if (!has_albedo_tables(*table.table())) exclude(table, normal_albedo_name, albedo_name);
    // The one parameter by image that the normal albedo depends on, of the Oren-Nayar law.
    exclude(table, normal_albedo_name, "slope_texture");
    double* const albedo =
        albedo_of(find_kind(material_kinds(), body.material.kind())->parameters(body.material));
    *albedo = 1;
    const double most = renderer::normal_albedo(body.material);
    *albedo = wanted / most;
    if (wanted > most)
        table.refuse(normal_albedo_name, fmt::format("{}: allowed 0 to {:.4g} with this law", wanted, most));
}

/// Frame, radii and name of a body by the scene's kernels.
void apply_kernels(Body& body, const BodyKeys& read, KernelKeys& kernels, const config::ReadTable& table) {
    const bool follows = follow_kernels(body.motion, body.parent, read.kernel, false, kernels, table);
    if (!read.kernel.body.empty() && body.name.empty()) body.name = read.kernel.body;
    const auto* ellipsoid = find_kind(shape_kinds(), renderer::EllipsoidParameters::kind);
    if (!follows || body.shape.kind() != ellipsoid->name || table.has(radii_name)) return;
    const ephemeris::Ephemeris& source = kernels.frame()->kernels();
    try {
        if (const auto radii = source.radii_m(source.body(read.kernel.body)))
            body.shape.get<renderer::EllipsoidParameters>().radii_m = *radii;
        else
            table.refuse_table("the key \"radii_m\" is missing, and no kernel has radii of the body");
    } catch (const Error& error) {
        table.refuse(ephemeris_name, error.what());
    }
}

void check_body(Scene& scene, std::size_t index, BodyKeys& read, KernelKeys& kernels,
                const config::ReadTable& table) {
    Body& body = scene.bodies[index];
    add_parameter_textures(read.textures, body.textures, table);
    exclude(table, "colour_curve", "colour");
    body.textures.albedo_model = read_texture_model(table, "albedo_texture");
    body.textures.emission_model = read_texture_model(table, "emission_texture");
    if (body.textures.has_emission() && body.emission_w_m2_sr.empty())
        table.refuse("emission_texture", "a factor on \"emission_w_m2_sr\", which is missing");
    apply_normal_albedo(body, read.normal_albedo, table);
    for (const Conflict& c : find_kind(shape_kinds(), body.shape.kind())->conflicts(body.shape))
        table.refuse(c.key, c.what);
    // With textured parameters, the renderer checks the rules at the extremes of their texels.
    if (body.textures.parameters.empty())
        for (const Conflict& c : find_kind(material_kinds(), body.material.kind())->conflicts(body.material))
            table.refuse(c.key, c.what);
    body.position = table.position_text();
    read.place.kernels = !kernels.files.empty();
    body.motion = motion_of(read.place, table);
    set_parent(read.joint, table, body.parent, body.motion);
    body.joint = joint_of(read.joint, table);
    apply_kernels(body, read, kernels, table);
    if (body.name.empty()) body.name = fmt::format("body{}", index);
    if (body.name == camera_name)
        table.mistakes().add(table.where().in("name"), table.table()->at,
                             fmt::format("\"{}\" is the camera's own name", body.name));
    const auto end = scene.bodies.begin() + static_cast<std::ptrdiff_t>(index);
    if (std::any_of(scene.bodies.begin(), end, [&](const Body& b) { return b.name == body.name; }))
        table.mistakes().add(table.where().in("name"), table.table()->at,
                             fmt::format("\"{}\" is the name of an earlier body", body.name));
}

/// Section of body `index`, with the keys of the kinds that `table` selects.
config::Section body_section(Scene& scene, std::size_t index, const std::shared_ptr<ColourCurves>& curves,
                             const std::shared_ptr<KernelKeys>& kernels, const config::Value& table) {
    Body& body = scene.bodies[index];
    const auto read = std::make_shared<BodyKeys>();
    read->place.epoch = kernels->epoch;
    config::Section section{"body", "A body."};
    section.keys = common_keys(body, *read);
    // A body of the kernels is an ellipsoid unless it says otherwise.
    const bool kernel_body = table.find(ephemeris_name) != nullptr;
    const ShapeKind* const ellipsoid = find_kind(shape_kinds(), renderer::EllipsoidParameters::kind);
    if (kernel_body)
        for (config::Key& key : section.keys)
            if (key.name == "shape") key = optional(key);
    const bool own_shape = is_model(table, shape_name);
    const ShapeKind* shape =
        own_shape ? find_kind(shape_kinds(), renderer::ModelShapeParameters::kind)
                  : chosen<ShapeKind>(table, shape_name, shape_kinds(), kernel_body ? ellipsoid : nullptr);
    // The default of a mesh file is its own materials, but an albedo alone selects Lambert.
    const bool own = shape != nullptr && !shape->own_material.empty() && table.find("albedo") == nullptr;
    const bool own_law = is_model(table, material_name);
    const MaterialKind* material =
        own_law ? find_kind(material_kinds(), renderer::ModelMaterialParameters::kind)
                : chosen(table, material_name, material_kinds(),
                         own ? find_kind(material_kinds(), shape->own_material) : &material_kinds().front());
    if (shape == nullptr || material == nullptr) {
        // Without valid kinds the other keys are unknown: accept all.
        for (const config::Member& member : table.members)
            if (!has(section.keys, member.key)) section.elsewhere.push_back(member.key);
        section.check = [read](const config::ReadTable& /*table*/) {}; // owns what the keys are bound to
        return section;
    }
    read->material = material->name;
    for (const auto& [name, has_model] : {std::pair{shape_name, own_shape}, {material_name, own_law}}) {
        if (!has_model) continue;
        std::erase_if(section.keys, [&own = name](const config::Key& key) { return key.name == own; });
        section.elsewhere.push_back(name);
    }
    add_kinds(section, body, *read, *shape, *material, table);
    std::vector<Stranger> strangers = strangers_in(table, section, *shape, *material);
    for (const Stranger& stranger : strangers)
        section.elsewhere.push_back(stranger.member->key);
    section.before = [strangers](const config::Value& /*table*/, const config::Where& where,
                                 config::Mistakes& mistakes) {
        for (const Stranger& stranger : strangers)
            mistakes.add(where.in(stranger.member->key), stranger.member->value.at, stranger.what);
    };
    section.check = [&scene, index, read, curves, kernels, shape, material](const config::ReadTable& t) {
        if (shape->name == renderer::ModelShapeParameters::kind) read_shape_model(t, scene.bodies[index]);
        if (material->name == renderer::ModelMaterialParameters::kind)
            read_material_model(t, scene.bodies[index]);
        check_body(scene, index, *read, *kernels, t);
        const bool own_colour = t.has("colour") || t.has("colour_curve");
        (*curves)[index] = own_colour ? read->colour_curve : material->colour_curve;
        if (material->preset) scene.bodies[index].preset = material->name;
    };
    return section;
}

/// Targets of the keys of a section for the reference.
struct Example {
    Body body;
    BodyKeys read;
    std::string variant, help;
};

/// Sections for the reference: keys of every body, then of each kind of shape and of material. The keys are
/// bound to `bound`.
std::vector<config::Section> make_examples(std::deque<Example>& bound) {
    std::vector<config::Section> sections;
    const auto add = [&](std::string variant, std::string help) -> Example& {
        Example& example = bound.emplace_back();
        example.variant = std::move(variant);
        example.help = std::move(help);
        config::Section& section = sections.emplace_back(config::Section{"body", example.help});
        section.variant = example.variant;
        return example;
    };
    Example& common = add("", "A body.");
    common.read.material = material_kinds().front().name;
    sections.back().keys = common_keys(common.body, common.read);
    for (const ShapeKind& kind : shape_kinds()) {
        Example& example = add(fmt::format("shape = \"{}\"", kind.name), std::string(kind.help));
        example.body.shape = kind.make_default();
        sections.back().keys = keys_of(kind.parameters(example.body.shape));
        // Tables that kinds share are listed with the first of them.
        const config::Section inside = kind.tables(example.body.shape);
        const auto listed = [&](const auto& inner) {
            return std::any_of(sections.begin(), sections.end() - 1,
                               [&](const config::Section& s) { return has_table(s, inner.name); });
        };
        std::copy_if(inside.tables.begin(), inside.tables.end(), std::back_inserter(sections.back().tables),
                     std::not_fn(listed));
        std::copy_if(inside.lists.begin(), inside.lists.end(), std::back_inserter(sections.back().lists),
                     std::not_fn(listed));
    }
    for (const MaterialKind& kind : material_kinds()) {
        Example& example = add(
            fmt::format("material = \"{}\"", kind.name),
            kind.preset ? fmt::format("{} Known {} ({}).", kind.help, text_of(kind.range), kind.range.source)
                        : std::string(kind.help));
        example.body.material = kind.make_default();
        const ParameterList parameters = kind.parameters(example.body.material);
        example.read.textures = textures_of(parameters);
        for (const Parameter& p : parameters)
            sections.back().keys.push_back(kind.preset ? optional(p.key) : p.key);
        if (albedo_of(parameters) != nullptr)
            sections.back().keys.push_back(normal_albedo_key(example.read.normal_albedo));
        const config::Keys textures = texture_keys(example.read.textures);
        sections.back().keys.insert(sections.back().keys.end(), textures.begin(), textures.end());
    }
    return sections;
}

} // namespace

config::List body_list(Scene& scene, std::shared_ptr<ColourCurves> curves,
                       std::shared_ptr<KernelKeys> kernels) {
    config::List list;
    list.name = "body";
    list.help = "A body, one table for each: shape, material, position, attitude and motion.";
    list.clear = [&scene, curves] {
        scene.bodies.clear();
        curves->clear();
    };
    list.append = [&scene, curves, kernels](const config::Value& table) {
        scene.bodies.emplace_back();
        curves->emplace_back();
        return body_section(scene, scene.bodies.size() - 1, curves, kernels, table);
    };
    list.size = [&scene] { return scene.bodies.size(); };
    // Scenes are not printed: list only the keys of every body.
    list.at = [&scene](std::size_t index) {
        config::Section section{"body", ""};
        section.keys = keys_of(scene.bodies.at(index));
        return section;
    };
    list.examples = [] {
        static std::deque<Example> bound;
        static const std::vector<config::Section> sections = make_examples(bound);
        return sections;
    };
    return list;
}

} // namespace obscura::scene
