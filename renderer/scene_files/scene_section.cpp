// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/scene_section.hpp"

#include "config/shipped_files.hpp"
#include "core/error.hpp"
#include "ephemeris/stars/star_file.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/materials/albedo_curve.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/scene/position.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/scene_files/body_section.hpp"
#include "renderer/scene_files/camera_section.hpp"
#include "renderer/scene_files/kernel_keys.hpp"
#include "renderer/scene_files/place_keys.hpp"
#include "renderer/scene_files/section_rules.hpp"
#include "renderer/scene_files/sky_object_section.hpp"
#include "renderer/scene_files/surface_places.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <string>

namespace obscura::scene {
namespace {

constexpr double astronomical_unit_m = 149'597'870'700.0; // IAU 2012 B2

/// Direction and distance of the Sun, instead of its position.
struct SunDirection {
    Vec3 direction{-1, 0, 0}; ///< from the origin towards the Sun
    double distance_au = 1;
};

config::Section sun_section(Sun& sun) {
    const auto read = std::make_shared<SunDirection>();
    config::Section section{"sun", "The Sun: position, disc and spectrum."};
    section.keys = keys_of(sun);
    section.keys.push_back(config::key("direction", &read->direction)
                               .range(anywhere)
                               .help("Direction from the origin to the Sun, instead of position_m"));
    section.keys.push_back(config::key("distance_au", &read->distance_au)
                               .unit("au")
                               .range(0.005, 1000)
                               .help("Distance of the Sun from the origin, with direction"));
    section.check = [&sun, read](const config::ReadTable& table) {
        exclude(table, "direction", "position_m");
        exclude(table, "distance_au", "position_m");
        require_direction(table, read->direction, "direction");
        if (table.has("direction") || table.has("distance_au"))
            sun.position_m = normalized(read->direction) * (read->distance_au * astronomical_unit_m);
    };
    return section;
}

/// A table of irradiances, which is read once the bands are known.
struct StarTable {
    std::filesystem::path file; ///< empty: none
};

struct StarKeys {
    std::string catalogue;
    double limiting_magnitude = 20;
    StarSpectrum spectrum = StarSpectrum::measured;
    std::string irradiances;
};

config::Section stars_section(Scene& scene, const std::shared_ptr<StarTable>& table_of_irradiances) {
    const auto read = std::make_shared<StarKeys>();
    config::Section section{"stars", "Stars from a catalogue; without the table there are none."};
    section.keys = {
        config::key("catalogue", config::Path{&read->catalogue, false})
            .help(
                "Star catalogue: file made by `obscura import stars`, CSV table ra_deg,dec_deg,v_mag[,b_v][,spectral_type][,parallax_mas] (J2000), or the name of a shipped one (\"bright\")"),
        config::key("limiting_magnitude", &read->limiting_magnitude)
            .unit("mag")
            .range(-30, 40)
            .help("Limiting visual magnitude: fainter stars are left out"),
        config::key("spectrum", &read->spectrum)
            .help("Spectra of the stars: that of the class by B-V and spectral type, or a black body by B-V"),
        config::key("irradiances", config::Path{&read->irradiances, true, true})
            .help(
                "CSV table x,y,z,e1,e2,...: stars of known light, by direction (J2000) and irradiance in each spectral band, W/m2; "
                "instead of a catalogue or beside it; empty: none"),
    };
    section.optional = true;
    section.check = [&scene, read, table_of_irradiances](const config::ReadTable& table) {
        if (table.table() == nullptr) return;
        table_of_irradiances->file = read->irradiances;
        if (read->irradiances.empty()) require(table, "catalogue");
        if (read->catalogue.empty()) return;
        const config::Value& value = table.table()->find("catalogue")->value;
        table.mistakes().collect([&] {
            const std::filesystem::path file = config::file_of_key(value, table.where().in("catalogue"),
                                                                   read->catalogue, config::shipped_stars);
            if (!ephemeris::StarFile::is_one(file)) {
                scene.stars = read_stars(file, read->limiting_magnitude);
                return;
            }
            try {
                scene.catalogue = {std::make_shared<const ephemeris::StarFile>(file),
                                   read->limiting_magnitude, read->spectrum};
            } catch (const InputError& error) {
                table.refuse("catalogue", error.what());
            }
        });
        for (Star& star : scene.stars)
            star.spectrum = read->spectrum;
    };
    return section;
}

/// Values of the keys of a lamp that are no members of Lamp.
struct LampPlace {
    PlaceKeys place;
    JointKeys joint;
    KernelPlaceKeys kernel;
};

config::Section lamp_section(Lamp& lamp, std::size_t index, const std::shared_ptr<KernelKeys>& kernels) {
    const auto read = std::make_shared<LampPlace>();
    read->place.epoch = kernels->epoch;
    config::Section section{
        "lamp", "A lamp: a point source or a beam that illuminates bodies, but is not visible itself."};
    section.keys = keys_of(lamp);
    for (const config::Keys& more :
         {camera_place_keys(read->place), keys_of(read->joint), keys_of(read->kernel, true)})
        section.keys.insert(section.keys.end(), more.begin(), more.end());
    section.check = [&lamp, index, read, kernels](const config::ReadTable& table) {
        lamp.joint = joint_of(read->joint, table);
        read->place.kernels = !kernels->files.empty();
        lamp.motion = motion_of(read->place, table);
        set_parent(read->joint, table, lamp.parent, lamp.motion);
        (void)follow_kernels(lamp.motion, lamp.parent, read->kernel, true, *kernels, table);
        lamp.position = table.position_text();
        if (lamp.name.empty()) lamp.name = fmt::format("lamp{}", index);
    };
    return section;
}

config::List lamp_list(std::vector<Lamp>& lamps, const std::shared_ptr<KernelKeys>& kernels) {
    config::List list;
    list.name = "lamp";
    list.help =
        "A lamp, one table for each: a point source or a beam that illuminates bodies, but is not visible itself.";
    list.clear = [&lamps] { lamps.clear(); };
    list.append = [&lamps, kernels](const config::Value& /*table*/) {
        lamps.emplace_back();
        return lamp_section(lamps.back(), lamps.size() - 1, kernels);
    };
    list.size = [&lamps] { return lamps.size(); };
    list.at = [&lamps, kernels](std::size_t index) { return lamp_section(lamps.at(index), index, kernels); };
    list.examples = [] {
        static Lamp fresh;
        static config::Section section = lamp_section(fresh, 0, std::make_shared<KernelKeys>());
        return std::vector{section};
    };
    return list;
}

config::Section band_section(SpectralBand& band) {
    config::Section section{"band", "A spectral band."};
    section.keys = keys_of(band);
    section.check = [&band](const config::ReadTable& table) {
        if (!(band.to_m > band.from_m)) table.refuse("to_nm", "must be greater than from_nm");
    };
    return section;
}

config::Section stray_light_section(StrayLight& stray) {
    config::Section section{"stray_light", "A map of stray light."};
    section.keys = keys_of(stray);
    section.check = [&stray](const config::ReadTable& table) { stray.position = table.position_text(); };
    return section;
}

/// Values of the keys of a landmark that are no members of Landmark.
struct LandmarkKeys {
    Vec3 position_m;
};

config::Section global_section(models::Global& global) {
    config::Section section{"global", "Value of a global of the models of users, in all that declare it."};
    section.keys = keys_of(global);
    section.check = [&global](const config::ReadTable& table) {
        if (table.has("values") && global.values.empty())
            table.refuse("values", "empty: allowed is 1 to 4 numbers");
    };
    return section;
}

config::Section landmark_section(Landmark& landmark) {
    const auto read = std::make_shared<LandmarkKeys>();
    config::Section section{"landmark", "A named point of a body, listed in the truth table of each frame."};
    section.keys = keys_of(landmark);
    section.keys.push_back(
        config::key("position_m", &read->position_m)
            .unit("m")
            .range(anywhere)
            .help("Point of the surface in the body's own frame, instead of longitude_deg and latitude_deg"));
    section.check = [&landmark, read](const config::ReadTable& table) {
        landmark.position = table.position_text();
        exclude(table, "longitude_deg", "position_m");
        exclude(table, "latitude_deg", "position_m");
        if (table.has("position_m"))
            landmark.position_m = read->position_m;
        else if (table.table() != nullptr && !(table.has("longitude_deg") && table.has("latitude_deg")))
            table.mistakes().add(table.where(), table.table()->at,
                                 "longitude_deg and latitude_deg are wanted, or position_m");
    };
    return section;
}

/// Checks parents and joints of bodies, camera, lamps and points.
void check_tree(const Scene& scene, const std::vector<SkyObject>& points, const config::ReadTable& root) {
    const auto check_parent = [&](const std::string& position, const std::string& parent, const Joint& joint,
                                  const std::string& place) {
        root.mistakes().collect(
            [&] { at_position(position, [&] { (void)parent_of(scene.bodies, parent, joint, place); }); });
    };
    root.mistakes().collect([&] { (void)parents_of(scene); });
    check_parent(scene.camera.position, scene.camera.parent, scene.camera.joint, "camera");
    for (const Lamp& lamp : scene.lamps)
        check_parent(lamp.position, lamp.parent, lamp.joint, fmt::format("lamp '{}'", lamp.name));
    for (const SkyObject& object : points)
        check_parent(object.position, object.parent, {}, fmt::format("sky object '{}'", object.name));
}

/// Gives the scene its sky objects, those that are as stars of a catalogue among its stars, and `objects`.
void take_sky_objects(const std::vector<SkyObject>& read, std::vector<SkyObject> objects, Scene& scene) {
    for (const SkyObject& object : read)
        if (object.kind == SkyObject::Kind::star && object.still())
            scene.stars.push_back(object.star);
        else
            objects.push_back(object);
    if (!objects.empty())
        scene.sky_objects = std::make_shared<const std::vector<SkyObject>>(std::move(objects));
}

/// Reports the key look_at of `table` if the scene has no body of that name.
void check_target(const Scene& scene, const Motion& motion, const config::Value& table,
                  const std::string& path, const config::ReadTable& root) {
    if (const std::string why = explain_missing_target(scene, motion); !why.empty())
        root.mistakes().add(root.where().in(path), table.find("look_at")->value.at, why);
}

/// Checks that `values`, a key of an element of a list, has one number for each band, or none.
void check_bands(const std::vector<double>& values, const char* list, std::size_t index, const char* key,
                 std::size_t bands, const config::ReadTable& root) {
    if (values.empty() || values.size() == bands) return;
    const config::Value& table = root.table()->find(list)->value.items[index];
    root.mistakes().add(
        root.where().in(fmt::format("{}[{}].{}", list, index, key)), table.find(key)->value.at,
        fmt::format("has {} numbers, allowed one for each of the {} bands", values.size(), bands));
}

void check_scene(Scene& scene, const ColourCurves& curves, const config::ReadTable& root) {
    if (const config::Member* camera = root.table()->find("camera"))
        check_target(scene, scene.camera.motion, camera->value, "camera.look_at", root);
    for (std::size_t i = 0; i < scene.lamps.size(); ++i)
        check_target(scene, scene.lamps[i].motion, root.table()->find("lamp")->value.items[i],
                     fmt::format("lamp[{}].look_at", i), root);
    for (std::size_t i = 0; i < scene.landmarks.size(); ++i)
        if (const std::string& body = scene.landmarks[i].body; index_of(scene.bodies, body) < 0)
            root.mistakes().add(root.where().in(fmt::format("landmark[{}].body", i)),
                                root.table()->find("landmark")->value.items[i].at,
                                fmt::format("\"{}\" is not the name of a body", body));
    if (const config::Member* bands = root.table()->find("band")) {
        const config::Where where = root.where().in("band");
        if (scene.bands.empty()) root.mistakes().add(where, bands->at, "at least one band is wanted");
        if (scene.bands.size() > max_bands)
            root.mistakes().add(where, bands->at, fmt::format("more than {} bands", max_bands));
    }
    for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
        check_bands(scene.bodies[i].colour, "body", i, "colour", scene.bands.size(), root);
        check_bands(scene.bodies[i].emission_w_m2_sr, "body", i, "emission_w_m2_sr", scene.bands.size(),
                    root);
    }
    for (std::size_t i = 0; i < scene.lamps.size(); ++i)
        check_bands(scene.lamps[i].intensity_w_sr, "lamp", i, "intensity_w_sr", scene.bands.size(), root);
    for (std::size_t i = 0; i < curves.size(); ++i) {
        Body& body = scene.bodies[i];
        body.colour_curve = curves[i];
        const auto* const preset = find_kind(renderer::material_kinds(), body.preset);
        if (preset != nullptr && !preset->albedo_curve.empty() && curves[i].empty() && body.colour.empty())
            body.colour_curve = renderer::follow_albedo_curve(body, preset->albedo_curve, scene.bands);
        for (std::size_t b = 0; !body.colour_curve.empty() && b < scene.bands.size(); ++b)
            body.colour.push_back(renderer::sunlit_mean(body.colour_curve, scene.bands[b]));
    }
}

} // namespace

config::Section scene_section(Scene& scene) {
    const auto curves = std::make_shared<ColourCurves>();
    const auto kernels = std::make_shared<KernelKeys>();
    const auto sky_objects = std::make_shared<std::vector<SkyObject>>();
    const auto star_table = std::make_shared<StarTable>();
    config::Section section{"", "A scene: bodies, light sources, stars and the camera."};
    section.keys = keys_of(scene);
    const config::Keys kernel_keys = kernels->keys();
    section.keys.insert(section.keys.begin() + 1, kernel_keys.begin(), kernel_keys.end());
    section.tables = {sun_section(scene.sun), stars_section(scene, star_table),
                      camera_section(scene.camera, kernels)};
    section.lists = {
        body_list(scene, curves, kernels),
        lamp_list(scene.lamps, kernels),
        sky_object_list(sky_objects, kernels),
        config::list("band", "A spectral band of the image, one table for each; without any, one band.",
                     scene.bands, band_section),
        config::list("landmark",
                     "A named point of a body, one table for each, for the truth table of frames.",
                     scene.landmarks, landmark_section),
        config::list("global", "A global of models that users have written, one table for each.",
                     scene.globals, global_section),
        config::list("stray_light", "A stray light map: ghosts and reflections of the optics.",
                     scene.stray_light, stray_light_section),
    };
    section.printed = false;
    section.check = [&scene, curves, kernels, sky_objects, star_table](const config::ReadTable& root) {
        std::vector<SkyObject> measured;
        if (!star_table->file.empty())
            root.mistakes().collect(
                [&] { measured = read_star_irradiances(star_table->file, scene.bands.size()); });
        kernels->check(scene, root);
        check_tree(scene, *sky_objects, root);
        find_surface_places(scene, *sky_objects, root.mistakes());
        take_sky_objects(*sky_objects, std::move(measured), scene);
        check_scene(scene, *curves, root);
    };
    return section;
}

} // namespace obscura::scene
