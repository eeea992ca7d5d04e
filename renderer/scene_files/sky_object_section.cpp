// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene_files/sky_object_section.hpp"

#include "core/units.hpp"
#include "renderer/scene/scene_keys.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "renderer/scene_files/place_keys.hpp"
#include "renderer/scene_files/section_rules.hpp"

#include <fmt/format.h>

namespace obscura::scene {
namespace {

constexpr double arc_second = degree / 3600;

/// Values of the keys of a sky object that are no members of SkyObject.
struct SkyObjectKeys {
    double b_v = 0.65;
    std::string spectral_type;
    PlaceKeys place;
    JointKeys joint;
    KernelPlaceKeys kernel;
};

config::Keys keys_of(SkyObject& s, SkyObjectKeys& read) {
    return {
        config::key("name", &s.name).help("Name in the truth table"),
        config::key("kind", &s.kind)
            .help("star: at a place on the sky; "
                  "point: at a place in space, lit by the Sun (satellite, planet); "
                  "galaxy: at a place on the sky, with Sersic's profile"),
        config::key("ra_deg", config::Scaled{&s.star.right_ascension_rad, degree})
            .unit("deg")
            .range(0, 360)
            .help("Right ascension of a star or galaxy, J2000"),
        config::key("dec_deg", config::Scaled{&s.star.declination_rad, degree})
            .unit("deg")
            .range(-90, 90)
            .help("Declination of a star or galaxy, J2000"),
        config::key("v_mag", &s.star.magnitude_v)
            .unit("mag")
            .range(-60, 60)
            .help(
                "Johnson V, of a galaxy that of all its light; of a point its V at 1 au from Sun and camera at phase angle 0"),
        config::key("b_v", &read.b_v)
            .unit("mag")
            .range(-5, 20)
            .help("Johnson B-V; without one, that of the type"),
        config::key("spectral_type", &read.spectral_type)
            .help("Spectral type such as \"G8III\"; with neither type nor b_v the light is as the Sun's"),
        config::key("rate_ra_arcsec_s", config::Scaled{s.rate_rad_s.data(), arc_second})
            .unit("arcsec/s")
            .range(-1e6, 1e6)
            .help(
                "Apparent motion of a star in right ascension times cos(declination), from scene time 0 on"),
        config::key("rate_dec_arcsec_s", config::Scaled{s.rate_rad_s.data() + 1, arc_second})
            .unit("arcsec/s")
            .range(-1e6, 1e6)
            .help("Apparent motion of a star in declination"),
        config::key("amplitude_mag", &s.amplitude_mag)
            .unit("mag")
            .range(0, 30)
            .help(
                "Variation of a star or point: V is v_mag + amplitude_mag sin(2 pi (t / period_s + phase))"),
        config::key("period_s", &s.period_s).unit("s").range(1e-3, 1e12).help("Period of the variation"),
        config::key("phase", &s.phase)
            .range(-1, 1)
            .help("Phase of the variation at scene time 0, in periods"),
        config::key("position_m", &read.place.position_m)
            .unit("m")
            .range(anywhere)
            .help("Position of a point, inertial or in the parent's frame"),
        config::key("trajectory", config::Path{&read.place.trajectory})
            .help(
                "CSV table time_s,x_m,y_m,z_m, or time_s,longitude_deg,latitude_deg,altitude_m over the parent, of a point, instead of position_m"),
        config::key("parent", &read.joint.parent)
            .help("Name of the body in whose frame a point's position is"),
        relative_to_key(read.joint.relative_to),
        config::key("planet", &s.planet)
            .help("Planet whose published V and phase law a point has, instead of v_mag and phase_law_mag"),
        config::key("phase_law_mag", &s.phase_law_mag)
            .unit("mag")
            .range(-100, 100)
            .help("Coefficients of the powers 1, 2, ... of a point's phase angle in degrees that add to V"),
        config::key("half_light_radius_arcsec", config::Scaled{&s.half_light_radius_rad, arc_second})
            .unit("arcsec")
            .range(0, 3600 * 10)
            .help("Radius of a galaxy that holds half its light, along the major axis"),
        config::key("sersic_index", &s.sersic_index)
            .range(0.3, 8)
            .help("Index of Sersic's profile; 1: exponential disc, 4: de Vaucouleurs"),
        config::key("axis_ratio", &s.axis_ratio).range(0.01, 1).help("Minor over major axis of a galaxy"),
        config::key("position_angle_deg", config::Scaled{&s.position_angle_rad, degree})
            .unit("deg")
            .range(-360, 360)
            .help("Position angle of a galaxy's major axis, from north over east"),
    };
}

/// Reports the keys that do not belong to the kind, and those that are missing.
void check_kind(const SkyObject& s, const config::ReadTable& table) {
    using Kind = SkyObject::Kind;
    const auto only = [&](bool fits, std::string_view key, const char* kinds) {
        if (table.has(key) && !fits) table.refuse(key, fmt::format("belongs to kind = {}", kinds));
    };
    const bool star = s.kind == Kind::star, point = s.kind == Kind::point, galaxy = s.kind == Kind::galaxy;
    for (const char* key : {"ra_deg", "dec_deg"}) {
        only(!point, key, "\"star\" or \"galaxy\"");
        if (!point) require(table, key);
    }
    for (const char* key : {"rate_ra_arcsec_s", "rate_dec_arcsec_s"})
        only(star, key, "\"star\"");
    for (const char* key : {"amplitude_mag", "period_s", "phase"})
        only(!galaxy, key, "\"star\" or \"point\"");
    for (const char* key :
         {"position_m", "trajectory", "parent", "relative_to", "ephemeris", "ephemeris_frame", "planet",
          "phase_law_mag", "longitude_deg", "latitude_deg", "altitude_m", "altitude_above", "latitudes"})
        only(point, key, "\"point\"");
    for (const char* key : {"half_light_radius_arcsec", "sersic_index", "axis_ratio", "position_angle_deg"})
        only(galaxy, key, "\"galaxy\"");
    if (galaxy) require(table, "half_light_radius_arcsec");
    if (s.planet == Planet::none) {
        require(table, "v_mag");
    } else {
        exclude(table, "v_mag", "planet");
        exclude(table, "phase_law_mag", "planet");
    }
    if (point && !table.has("position_m") && !table.has("trajectory") && !table.has("ephemeris") &&
        !has_surface_place(table))
        table.refuse_table(
            "the key \"position_m\", \"longitude_deg\", \"trajectory\" or \"ephemeris\" is missing");
}

config::Section sky_object_section(SkyObject& object, const std::shared_ptr<KernelKeys>& kernels) {
    const auto read = std::make_shared<SkyObjectKeys>();
    read->place.epoch = kernels->epoch;
    config::Section section{"sky_object",
                            "A star that moves or varies, a point in space with a phase law, or a galaxy."};
    section.keys = keys_of(object, *read);
    const config::Keys kernel_keys = keys_of(read->kernel, true);
    section.keys.insert(section.keys.end(), kernel_keys.begin(), kernel_keys.end());
    const config::Keys surface_keys = keys_of(read->place.surface, false);
    section.keys.insert(section.keys.end(), surface_keys.begin(), surface_keys.end());
    section.check = [&object, read, kernels](const config::ReadTable& table) {
        object.position = table.position_text();
        check_kind(object, table);
        if (object.planet != Planet::none) object.star.colour_b_v = planet_colour_b_v(object.planet);
        if (table.has("b_v")) object.star.colour_b_v = read->b_v;
        if (!read->spectral_type.empty()) {
            object.star.type = parse_spectral_type(read->spectral_type);
            if (!object.star.type) table.refuse("spectral_type", "is no type O to M, such as \"G8III\"");
        }
        if (object.kind != SkyObject::Kind::point) return;
        read->place.kernels = !kernels->files.empty();
        object.motion = motion_of(read->place, table);
        set_parent(read->joint, table, object.parent, object.motion);
        (void)follow_kernels(object.motion, object.parent, read->kernel, true, *kernels, table);
    };
    return section;
}

} // namespace

config::List sky_object_list(const std::shared_ptr<std::vector<SkyObject>>& objects,
                             const std::shared_ptr<KernelKeys>& kernels) {
    config::List list;
    list.name = "sky_object";
    list.help =
        "A sky object beside bodies and catalogue, one table for each: a star that moves or varies (or is in no catalogue), a point in space with a phase law (satellite, planet), a galaxy.";
    list.clear = [objects] { objects->clear(); };
    list.append = [objects, kernels](const config::Value& /*table*/) {
        objects->emplace_back();
        return sky_object_section(objects->back(), kernels);
    };
    list.size = [objects] { return objects->size(); };
    list.at = [objects, kernels](std::size_t index) {
        return sky_object_section(objects->at(index), kernels);
    };
    list.examples = [] {
        static SkyObject fresh;
        static config::Section section = sky_object_section(fresh, std::make_shared<KernelKeys>());
        return std::vector{section};
    };
    return list;
}

} // namespace obscura::scene
