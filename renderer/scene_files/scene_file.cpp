#include "renderer/scene/scene_file.hpp"

#include "core/error.hpp"
#include "renderer/scene/kinds.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/scene/trajectory.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace obscura::scene {
namespace {

constexpr double astronomical_unit_m = 149'597'870'700.0; // IAU 2012 B2
constexpr double degree = std::numbers::pi / 180;

bool has(const config::Given& given, std::string_view key) {
    return given.find(key) != given.end();
}

void require(const config::Given& given, std::string_view key, const config::Value& table,
             const config::Where& where) {
    if (!has(given, key)) fail(where, table.at, fmt::format("the key \"{}\" is missing", key));
}

void exclude(const config::Given& given, std::string_view key, std::string_view other,
             const config::Where& where) {
    if (has(given, key) && has(given, other))
        fail(where.in(key), given.find(key)->second, fmt::format("cannot stand beside \"{}\"", other));
}

void require_direction(Vec3 v, std::string_view key, const config::Given& given, const config::Where& where) {
    if (has(given, key) && !(length(v) > 0))
        fail(where.in(key), given.find(key)->second, "a vector that is not zero is wanted");
}

scene::Sun read_sun(const config::Value& table, const config::Where& where) {
    SunKeys sun;
    const config::Given given = read_keys(table, where, keys_of(sun));
    exclude(given, "direction", "position_m", where);
    exclude(given, "distance_au", "position_m", where);
    require_direction(sun.direction, "direction", given, where);
    require_direction(sun.position_m, "position_m", given, where);
    scene::Sun result;
    result.irradiance_scale = sun.irradiance_scale;
    result.radius_m = sun.radius_m;
    result.limb_darkening = sun.limb_darkening;
    if (has(given, "position_m"))
        result.position_m = sun.position_m;
    else
        result.position_m = normalized(sun.direction) * (sun.distance_au * astronomical_unit_m);
    return result;
}

scene::Motion motion_of(const PlaceKeys& place, const config::Given& given, const config::Value& table,
                        const config::Where& where) {
    for (const char* key : {"position_m", "orientation", "boresight", "look_at_m", "up"})
        exclude(given, key, "trajectory", where);
    exclude(given, "orientation", "boresight", where);
    exclude(given, "orientation", "look_at_m", where);
    exclude(given, "look_at_m", "boresight", where);
    exclude(given, "up", "orientation", where);
    require_direction(place.boresight, "boresight", given, where);
    require_direction(place.up, "up", given, where);
    require_direction(place.spin_axis, "spin_axis", given, where);

    scene::Motion motion;
    motion.spin_axis = place.spin_axis;
    motion.spin_rate_rad_s = place.spin_rate_deg_per_s * degree;
    if (has(given, "trajectory")) {
        motion.samples = read_trajectory(place.trajectory);
        return motion;
    }
    Pose pose{place.position_m, place.orientation};
    if (has(given, "boresight") || has(given, "look_at_m")) {
        const char* key = has(given, "boresight") ? "boresight" : "look_at_m";
        const Vec3 boresight = has(given, "boresight") ? place.boresight : place.look_at_m - place.position_m;
        if (!(length(boresight) > 0))
            fail(where.in(key), given.find(key)->second, "is the camera's own position");
        if (!(length(cross(boresight, place.up)) > 1e-9 * length(boresight) * length(place.up)))
            fail(where.in(key), given.find(key)->second, "is parallel to \"up\"");
        pose.orientation = look_along(boresight, place.up);
    } else if (has(given, "up")) {
        fail(where, table.at, "\"up\" needs \"boresight\" or \"look_at_m\"");
    }
    motion.samples = {{0, pose}};
    return motion;
}

scene::Joint joint_of(const JointKeys& keys, const config::Given& given, const config::Where& where) {
    using Kind = scene::Joint::Kind;
    const auto only_with = [&](const char* key, bool fits, const char* kinds) {
        if (has(given, key) && !fits)
            fail(where.in(key), given.find(key)->second, fmt::format("belongs to joint = {}", kinds));
    };
    only_with("joint", !keys.parent.empty() || keys.kind == Kind::fixed,
              "\"fixed\" where there is no parent");
    only_with("joint_axis", keys.kind != Kind::fixed, "\"hinge\" or \"slide\"");
    only_with("joint_table", keys.kind != Kind::fixed, "\"hinge\" or \"slide\"");
    only_with("joint_angle_deg", keys.kind == Kind::hinge, "\"hinge\"");
    only_with("joint_offset_m", keys.kind == Kind::slide, "\"slide\"");
    exclude(given, "joint_angle_deg", "joint_table", where);
    exclude(given, "joint_offset_m", "joint_table", where);
    require_direction(keys.axis, "joint_axis", given, where);
    scene::Joint joint{keys.kind, keys.axis, {}};
    if (joint.kind == Kind::fixed) return joint;
    const bool hinge = joint.kind == Kind::hinge;
    if (has(given, "joint_table"))
        joint.samples = read_joint_table(keys.table, hinge ? "angle_deg" : "offset_m", hinge ? degree : 1);
    else
        joint.samples = {{0, hinge ? keys.angle_deg * degree : keys.offset_m}};
    return joint;
}

scene::Camera read_camera(const config::Value& table, const config::Where& where) {
    scene::Camera camera;
    PlaceKeys place;
    JointKeys joint;
    config::Keys keys = keys_of(camera);
    for (const config::Keys& more : {camera_place_keys(place), keys_of(joint)})
        keys.insert(keys.end(), more.begin(), more.end());
    const config::Given given = read_keys(table, where, keys);
    camera.parent = joint.parent;
    camera.joint = joint_of(joint, given, where);
    if (camera.psf.model == scene::PointSpread::Model::table) require(given, "psf_file", table, where);
    camera.motion = motion_of(place, given, table, where);
    return camera;
}

/// The kind that the word at `key` of `table` chooses; `fallback` when the key is not there.
template<typename Variant>
const Kind<Variant>& chosen(const config::Value& table, const config::Where& where, std::string_view key,
                            const std::vector<Kind<Variant>>& kinds, std::string_view fallback) {
    std::string word(fallback);
    config::Value only;
    if (const config::Member* member = table.find(key)) only.members.push_back(*member);
    read_keys(only, where, config::Keys{config::key(key, &word).choices(names_of(kinds))});
    if (word.empty()) fail(where, table.at, fmt::format("the key \"{}\" is missing", key));
    return *std::find_if(kinds.begin(), kinds.end(), [&](const Kind<Variant>& k) { return k.name == word; });
}

/// A key of another kind would be ignored: say so instead.
template<typename Variant>
void refuse_strangers(const config::Value& table, const config::Where& where, const config::Keys& known,
                      std::string_view what, const Kind<Variant>& kind,
                      const std::vector<Kind<Variant>>& kinds) {
    for (const config::Member& member : table.members) {
        const auto same = [&](const config::Key& key) { return key.name == member.key; };
        if (std::any_of(known.begin(), known.end(), same)) continue;
        const std::vector<std::string_view> owners = kinds_with(kinds, member.key);
        if (!owners.empty())
            fail(where.in(member.key), member.value.at,
                 fmt::format("belongs to {} = \"{}\", this body's is \"{}\"", what,
                             fmt::join(owners, "\" or \""), kind.name));
    }
}

/// Mean over a band of a curve that is linear between its points and held outside; exact.
double band_mean(const std::vector<SpectralPoint>& curve, const SpectralBand& band) {
    const auto at = [&](double wavelength_m) {
        const auto after =
            std::lower_bound(curve.begin(), curve.end(), wavelength_m,
                             [](const SpectralPoint& p, double w) { return p.wavelength_m < w; });
        if (after == curve.begin()) return curve.front().value;
        if (after == curve.end()) return curve.back().value;
        const SpectralPoint& before = *(after - 1);
        const double share =
            (wavelength_m - before.wavelength_m) / (after->wavelength_m - before.wavelength_m);
        return before.value + share * (after->value - before.value);
    };
    // Trapezoids between the ends and the points inside.
    double sum = 0;
    double from = band.from_m;
    const auto add_up_to = [&](double to) {
        sum += (at(from) + at(to)) / 2 * (to - from);
        from = to;
    };
    for (const SpectralPoint& p : curve)
        if (p.wavelength_m > band.from_m && p.wavelength_m < band.to_m) add_up_to(p.wavelength_m);
    add_up_to(band.to_m);
    return sum / (band.to_m - band.from_m);
}

/// `curve` gets the body's colour over wavelength, if it has one.
scene::Body read_body(const config::Value& table, const config::Where& where,
                      std::vector<SpectralPoint>& curve) {
    const Kind<scene::Shape>& shape = chosen(table, where, "shape", shape_kinds(), "");
    // A mesh without a word about its material has that of its file.
    const bool own = shape.name == "mesh" && table.find("albedo") == nullptr;
    const Kind<scene::Material>& material =
        chosen(table, where, "material", material_kinds(), own ? "file" : "lambert");
    BodyKeys keys;
    scene::Body body;
    body.shape = shape.make();
    body.material = material.make();
    config::Keys list = keys_of(keys);
    std::vector<ParameterTextureKeys> textures = parameter_textures(material.keys(body.material));
    for (const config::Keys& more : {keys_of(keys.joint), body_place_keys(keys.place), shape.keys(body.shape),
                                     material.keys(body.material), keys_of(textures)})
        list.insert(list.end(), more.begin(), more.end());
    refuse_strangers(table, where, list, "shape", shape, shape_kinds());
    refuse_strangers(table, where, list, "material", material, material_kinds());
    const config::Given given = read_keys(table, where, list);
    for (const std::string_view key : shape.required)
        require(given, key, table, where);
    for (const ParameterTextureKeys& t : textures) {
        exclude(given, t.file_key, t.constant_key, where);
        if (has(given, t.range_key)) require(given, t.file_key, table, where);
        if (!t.file.empty())
            keys.textures.parameters.push_back({t.parameter, t.file, t.range[0] * t.si, t.range[1] * t.si});
    }
    for (const std::string_view key : material.required) {
        const bool by_texture = std::any_of(textures.begin(), textures.end(), [&](const auto& t) {
            return t.constant_key == key && !t.file.empty();
        });
        if (!by_texture) require(given, key, table, where);
    }
    exclude(given, "colour_curve", "colour", where);
    body.name = keys.name;
    body.motion = motion_of(keys.place, given, table, where);
    body.colour = keys.colour;
    curve = keys.colour_curve;
    body.emission_w_m2_sr = keys.emission_w_m2_sr;
    body.textures = keys.textures;
    body.parent = keys.joint.parent;
    body.joint = joint_of(keys.joint, given, where);
    return body;
}

scene::Lamp read_lamp(const config::Value& table, const config::Where& where) {
    LampKeys keys;
    config::Keys list = keys_of(keys);
    for (const config::Keys& more : {camera_place_keys(keys.place), keys_of(keys.joint)})
        list.insert(list.end(), more.begin(), more.end());
    const config::Given given = read_keys(table, where, list);
    require(given, "intensity_w_sr", table, where);
    scene::Lamp lamp;
    lamp.parent = keys.joint.parent;
    lamp.joint = joint_of(keys.joint, given, where);
    lamp.name = keys.name;
    lamp.motion = motion_of(keys.place, given, table, where);
    lamp.beam = keys.beam == "uniform"    ? scene::Lamp::Beam::uniform
                : keys.beam == "gaussian" ? scene::Lamp::Beam::gaussian
                                          : scene::Lamp::Beam::point;
    lamp.half_angle_rad = keys.half_angle_deg * degree;
    lamp.intensity_w_sr = keys.intensity_w_sr;
    return lamp;
}

} // namespace

std::string read_view(const config::Value& table, const config::Where& where, scene::Camera& camera) {
    PlaceKeys place;
    JointKeys joint;
    config::Keys place_keys = camera_place_keys(place);
    const config::Keys joint_keys = keys_of(joint);
    place_keys.insert(place_keys.end(), joint_keys.begin(), joint_keys.end());
    config::Keys keys = keys_of(camera);
    keys.insert(keys.end(), place_keys.begin(), place_keys.end());
    const config::Given given = read_keys(table, where, keys);
    const bool placed = std::any_of(place_keys.begin(), place_keys.end(),
                                    [&](const config::Key& key) { return has(given, key.name); });
    if (placed) {
        camera.motion = motion_of(place, given, table, where);
        camera.parent = joint.parent;
        camera.joint = joint_of(joint, given, where);
    }
    keys.erase(std::remove_if(keys.begin(), keys.end(),
                              [&](const config::Key& key) { return !has(given, key.name); }),
               keys.end());
    return print_keys(keys);
}

scene::Scene load_scene(const std::filesystem::path& file) {
    const config::Value root = config::parse_file(file);
    const config::Where top{file, ""};
    scene::Scene scene;
    read_keys(root, top, keys_of(scene), {"sun", "stars", "camera", "body", "lamp", "band", "stray_light"});
    if (scene.name.empty()) scene.name = file.stem().string();

    if (const config::Member* sun = root.find("sun"))
        scene.sun = read_sun(expect_table(sun->value, top.in("sun")), top.in("sun"));
    if (const config::Member* camera = root.find("camera"))
        scene.camera = read_camera(expect_table(camera->value, top.in("camera")), top.in("camera"));
    if (const config::Member* stars = root.find("stars")) {
        const config::Where where = top.in("stars");
        StarKeys keys;
        const config::Value& table = expect_table(stars->value, where);
        require(read_keys(table, where, keys_of(keys)), "catalogue", table, where);
        scene.stars = read_stars(keys.catalogue, keys.limiting_magnitude);
    }
    std::vector<std::vector<SpectralPoint>> curves;
    if (const config::Member* bodies = root.find("body")) {
        const std::vector<config::Value>& tables = expect_tables(*bodies, top.in("body"));
        std::set<std::string> names;
        for (std::size_t i = 0; i < tables.size(); ++i) {
            const config::Where where = top.in(fmt::format("body[{}]", i));
            scene.bodies.push_back(read_body(tables[i], where, curves.emplace_back()));
            scene::Body& body = scene.bodies.back();
            if (body.name.empty()) body.name = fmt::format("body{}", i);
            if (!names.insert(body.name).second)
                fail(where.in("name"), tables[i].at,
                     fmt::format("\"{}\" is the name of an earlier body", body.name));
        }
    }
    if (const config::Member* lamps = root.find("lamp")) {
        const std::vector<config::Value>& tables = expect_tables(*lamps, top.in("lamp"));
        for (std::size_t i = 0; i < tables.size(); ++i) {
            scene.lamps.push_back(read_lamp(tables[i], top.in(fmt::format("lamp[{}]", i))));
            if (scene.lamps.back().name.empty()) scene.lamps.back().name = fmt::format("lamp{}", i);
        }
    }
    try {
        (void)scene::parents_of(scene.bodies);
        (void)scene::parent_of(scene.bodies, scene.camera.parent, scene.camera.joint, "camera");
        for (const scene::Lamp& lamp : scene.lamps)
            (void)scene::parent_of(scene.bodies, lamp.parent, lamp.joint,
                                   fmt::format("lamp '{}'", lamp.name));
    } catch (const ConfigError& error) {
        throw ConfigError(fmt::format("{}: {}", file.string(), error.what()));
    }
    if (const config::Member* bands = root.find("band")) {
        const std::vector<config::Value>& tables = expect_tables(*bands, top.in("band"));
        scene.bands.clear();
        for (std::size_t i = 0; i < tables.size(); ++i) {
            const config::Where where = top.in(fmt::format("band[{}]", i));
            SpectralBand band;
            const config::Given given = read_keys(tables[i], where, keys_of(band));
            require(given, "from_nm", tables[i], where);
            require(given, "to_nm", tables[i], where);
            if (!(band.to_m > band.from_m))
                fail(where.in("to_nm"), given.find("to_nm")->second, "must be greater than from_nm");
            scene.bands.push_back(band);
        }
        if (scene.bands.empty()) fail(top.in("band"), bands->at, "at least one band is wanted");
        if (scene.bands.size() > 16) fail(top.in("band"), bands->at, "more than 16 bands");
    }
    for (std::size_t i = 0; i < curves.size(); ++i)
        for (std::size_t b = 0; !curves[i].empty() && b < scene.bands.size(); ++b)
            scene.bodies[i].colour.push_back(band_mean(curves[i], scene.bands[b]));
    if (const config::Member* maps = root.find("stray_light")) {
        const std::vector<config::Value>& tables = expect_tables(*maps, top.in("stray_light"));
        for (std::size_t i = 0; i < tables.size(); ++i) {
            const config::Where where = top.in(fmt::format("stray_light[{}]", i));
            scene::StrayLight stray;
            require(read_keys(tables[i], where, keys_of(stray)), "file", tables[i], where);
            scene.stray_light.push_back(stray);
        }
    }
    // One number for each band, or none.
    const auto check_bands = [&](const std::vector<double>& values, const char* list, std::size_t i,
                                 const char* key) {
        if (values.empty() || values.size() == scene.bands.size()) return;
        const config::Value& table = root.find(list)->value.items[i];
        fail(top.in(fmt::format("{}[{}].{}", list, i, key)), table.find(key)->value.at,
             fmt::format("has {} numbers, allowed one for each of the {} bands", values.size(),
                         scene.bands.size()));
    };
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        check_bands(scene.bodies[i].colour, "body", i, "colour");
        check_bands(scene.bodies[i].emission_w_m2_sr, "body", i, "emission_w_m2_sr");
    }
    for (std::size_t i = 0; i < scene.lamps.size(); ++i)
        check_bands(scene.lamps[i].intensity_w_sr, "lamp", i, "intensity_w_sr");
    return scene;
}

} // namespace obscura::scene
