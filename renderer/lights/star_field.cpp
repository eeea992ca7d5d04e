// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/star_field.hpp"

#include "core/error.hpp"
#include "core/units.hpp"
#include "renderer/lights/galaxy.hpp"
#include "renderer/scene/star_catalogue.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Black bodies are tabulated by B-V in steps of 0.001 mag, those of a catalogue file.
constexpr double bluest_b_v = -0.4, reddest_b_v = 2.5, steps_per_mag = 1000;

} // namespace

Vec3 star_direction(double right_ascension_rad, double declination_rad) {
    return ephemeris::direction_of(right_ascension_rad, declination_rad);
}

void FieldStars::clear() {
    numbers.clear();
    places.clear();
    irradiance_w_m2.clear();
}

StarPhotometry::StarPhotometry(const std::vector<SpectralBand>& bands, scene::StarSpectrum spectrum)
    : spectrum_(spectrum) {
    std::vector<StarBins> weights_um;
    for (const SpectralBand& band : bands)
        weights_um.push_back(star_band_weights_um(band));
    const auto add = [&](const StarBins& flux) {
        for (const StarBins& weights : weights_um)
            zero_w_m2_.push_back(star_irradiance_w_m2(scene::Star{}, flux, weights));
    };
    if (spectrum == scene::StarSpectrum::measured) {
        for (const StarTemplate& t : star_templates())
            add(t.flux);
        return;
    }
    scene::Star star;
    star.spectrum = spectrum;
    for (int i = 0; i <= std::lround((reddest_b_v - bluest_b_v) * steps_per_mag); ++i) {
        star.colour_b_v = bluest_b_v + i / steps_per_mag;
        add(star_spectrum(star));
    }
}

void StarPhotometry::irradiance(const scene::Star& star, std::span<double> irradiance_w_m2) const {
    StarMix mix;
    if (spectrum_ == scene::StarSpectrum::measured) {
        mix = star_mix(star);
    } else {
        const double at =
            (std::clamp(star_colour(star), bluest_b_v, reddest_b_v) - bluest_b_v) * steps_per_mag;
        mix.first = mix.second = static_cast<std::size_t>(std::lround(at));
    }
    const std::size_t bands = irradiance_w_m2.size();
    const double scale = std::pow(10, -0.4 * star.magnitude_v);
    for (std::size_t b = 0; b < bands; ++b) {
        const double first = zero_w_m2_[mix.first * bands + b], second = zero_w_m2_[mix.second * bands + b];
        irradiance_w_m2[b] = scale * (first + mix.share * (second - first));
    }
}

StarField::StarField(const scene::Scene& scene)
    : file_(scene.catalogue.file),
      limiting_v_(scene.catalogue.limiting_v),
      spectrum_(scene.catalogue.spectrum),
      photometry_(file_ ? scene.bands : std::vector<SpectralBand>{}, scene.catalogue.spectrum),
      bands_(scene.bands.size()) {
    std::vector<StarBins> weights_um;
    for (const SpectralBand& band : scene.bands)
        weights_um.push_back(star_band_weights_um(band));
    for (std::size_t i = 0; i < scene.stars.size(); ++i) {
        const scene::Star& s = scene.stars[i];
        if (!std::isfinite(s.right_ascension_rad) || !std::isfinite(s.declination_rad) ||
            !std::isfinite(s.magnitude_v) || !std::isfinite(s.colour_b_v.value_or(0)))
            throw ConfigError(fmt::format("stars: star {} has a number that is not finite", i + 1));
        directions_.push_back(star_direction(s.right_ascension_rad, s.declination_rad));
        const StarBins spectrum = star_spectrum(s);
        for (const StarBins& weights : weights_um)
            irradiance_w_m2_.push_back(star_irradiance_w_m2(s, spectrum, weights));
    }
    if (!scene.sky_objects) return;
    for (const scene::SkyObject& object : *scene.sky_objects)
        if (object.kind == scene::SkyObject::Kind::galaxy)
            add_galaxy(object, scene.bands);
        else if (!object.irradiance_w_m2.empty())
            add_measured(object);
}

void StarField::add_measured(const scene::SkyObject& star) {
    point_directions_.push_back(star_direction(star.star.right_ascension_rad, star.star.declination_rad));
    point_irradiance_w_m2_.insert(point_irradiance_w_m2_.end(), star.irradiance_w_m2.begin(),
                                  star.irradiance_w_m2.end());
}

void StarField::add_galaxy(const scene::SkyObject& galaxy, const std::vector<SpectralBand>& bands) {
    const std::vector<Vec3> points = galaxy_points(galaxy);
    point_directions_.insert(point_directions_.end(), points.begin(), points.end());
    std::vector<double> share;
    for (const SpectralBand& band : bands)
        share.push_back(star_irradiance_w_m2(galaxy.star, band) / static_cast<double>(points.size()));
    for (std::size_t i = 0; i < points.size(); ++i)
        point_irradiance_w_m2_.insert(point_irradiance_w_m2_.end(), share.begin(), share.end());
}

StarPlace StarField::place(std::uint32_t number) const {
    if (number < directions_.size()) return {directions_[number], {}, 0};
    const ephemeris::CatalogueStar star =
        file_->star(number - static_cast<std::uint32_t>(directions_.size()));
    return {star.direction, ephemeris::proper_motion(star), star.parallax_mas * milliarcsecond};
}

void StarField::irradiance_of(std::uint32_t number, std::span<double> irradiance_w_m2) const {
    if (number < directions_.size())
        std::copy_n(irradiance_w_m2_.data() + number * bands_, bands_, irradiance_w_m2.begin());
    else
        photometry_.irradiance(
            scene::photometric_star(file_->star(number - static_cast<std::uint32_t>(directions_.size())),
                                    spectrum_),
            irradiance_w_m2);
}

double StarField::irradiance(std::uint32_t number, std::size_t band) const {
    std::array<double, scene::max_bands> all{};
    irradiance_of(number, {all.data(), bands_});
    return all[band];
}

void StarField::add(std::uint32_t number, FieldStars& stars) const {
    stars.numbers.push_back(number);
    stars.places.push_back(place(number));
    stars.irradiance_w_m2.resize(stars.irradiance_w_m2.size() + bands_);
    irradiance_of(number, std::span(stars.irradiance_w_m2).last(bands_));
}

void StarField::inside(Vec3 axis, double half_angle_rad, const StarObserver& observer,
                       FieldStars& stars) const {
    stars.clear();
    const double limit = std::cos(std::min(half_angle_rad, std::numbers::pi)) - 1e-12;
    for (std::size_t i = 0; i < directions_.size(); ++i)
        if (dot(directions_[i], axis) >= limit) add(static_cast<std::uint32_t>(i), stars);
    if (file_) {
        const double half =
            half_angle_rad + file_->largest_shift_rad(observer.years, observer.position_au) + 1e-9;
        file_->for_each({axis, std::min(half, std::numbers::pi)}, limiting_v_, [&](std::uint32_t number) {
            add(static_cast<std::uint32_t>(directions_.size()) + number, stars);
        });
    }
    for (std::size_t i = 0; i < point_directions_.size(); ++i) {
        if (dot(point_directions_[i], axis) < limit) continue;
        stars.numbers.push_back(no_star);
        stars.places.push_back({point_directions_[i], {}, 0});
        const auto bands = std::span(point_irradiance_w_m2_).subspan(i * bands_, bands_);
        stars.irradiance_w_m2.insert(stars.irradiance_w_m2.end(), bands.begin(), bands.end());
    }
}

} // namespace obscura::renderer
