// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/sky_sources.hpp"

#include "core/solar_spectrum.hpp"
#include "ephemeris/kernels/apparent_place.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/lights/galaxy.hpp"
#include "renderer/lights/star_field.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

using std::numbers::pi;

} // namespace

SkySources::SkySources(const scene::Scene& scene) : scene_(scene) {
    if (!scene.sky_objects) return;
    for (const scene::SkyObject& object : *scene.sky_objects) {
        if (object.kind == scene::SkyObject::Kind::galaxy) {
            Galaxy& galaxy = galaxies_.emplace_back();
            galaxy.object = &object;
            galaxy.direction = star_direction(object.star.right_ascension_rad, object.star.declination_rad);
            for (const SpectralBand& band : scene.bands)
                galaxy.irradiance_w_m2.push_back(star_irradiance_w_m2(object.star, band));
        }
        if (object.still() || object.kind == scene::SkyObject::Kind::galaxy) continue;
        moving_.push_back(&object);
        scene::Star star = object.star;
        star.magnitude_v = 0;
        for (const SpectralBand& band : scene.bands)
            zero_w_m2_.push_back(star_irradiance_w_m2(star, band));
    }
}

std::optional<SkySource> SkySources::at(std::size_t i, const std::vector<BuiltBody>& bodies, Vec3 camera_m,
                                        double time_s) const {
    const scene::SkyObject& object = *moving_[i];
    const double variation =
        object.amplitude_mag * std::sin(2 * pi * (time_s / object.period_s + object.phase));
    SkySource source;
    if (object.kind == scene::SkyObject::Kind::star) {
        const scene::Star& star = object.star;
        const SkyTangents tangents(star.right_ascension_rad, star.declination_rad);
        source.direction = normalized(
            tangents.centre +
            (tangents.east * object.rate_rad_s[0] + tangents.north * object.rate_rad_s[1]) * time_s);
        if (scene_.light_deflection)
            source.direction = ephemeris::starlight_deflected_by_sun(
                source.direction, scene_.sun.position_at(time_s) - camera_m);
        source.magnitude_v = star.magnitude_v + variation;
        return source;
    }
    Vec3 place = point_position(scene_, bodies, object, time_s);
    // With light time: where it was when the light left it, as of bodies.
    for (int k = 0; scene_.light_time && k < 3; ++k)
        place = point_position(scene_, bodies, object, time_s - length(place - camera_m) / light_speed_m_s);
    const Vec3 sun = scene_.sun.position_at(time_s);
    const Vec3 to_object = place - camera_m, to_sun = sun - place;
    source.distance_m = length(to_object);
    const double sun_m = length(to_sun);
    if (!(source.distance_m > 0) || !(sun_m > 0)) return std::nullopt;
    source.direction =
        (scene_.light_deflection ? ephemeris::deflected_by_sun(to_object, sun - camera_m) : to_object) /
        source.distance_m;
    const double phase_rad = std::atan2(length(cross(to_object, to_sun)), -dot(to_object, to_sun));
    source.magnitude_v = scene::phase_magnitude_v(object, phase_rad) + variation +
                         5 * std::log10(source.distance_m / astronomical_unit_m) +
                         5 * std::log10(sun_m / astronomical_unit_m) -
                         2.5 * std::log10(std::max(scene_.sun.irradiance_scale, 1e-30));
    return source;
}

void SkySources::irradiance(std::size_t i, const SkySource& source, std::span<double> irradiance_w_m2) const {
    const double scale = std::pow(10, -0.4 * source.magnitude_v);
    const std::size_t bands = irradiance_w_m2.size();
    for (std::size_t b = 0; b < bands; ++b)
        irradiance_w_m2[b] = scale * zero_w_m2_[i * bands + b];
}

} // namespace obscura::renderer
