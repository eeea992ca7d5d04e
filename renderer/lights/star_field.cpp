// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/star_field.hpp"

#include "core/error.hpp"
#include "renderer/lights/star_spectra.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace obscura::renderer {

Vec3 star_direction(double right_ascension_rad, double declination_rad) {
    const double c = std::cos(declination_rad);
    return {c * std::cos(right_ascension_rad), c * std::sin(right_ascension_rad), std::sin(declination_rad)};
}

StarField::StarField(const std::vector<scene::Star>& stars, const std::vector<SpectralBand>& bands)
    : bands_(bands.size()) {
    std::vector<StarBins> weights_um;
    for (const SpectralBand& band : bands)
        weights_um.push_back(star_band_weights_um(band));
    for (std::size_t i = 0; i < stars.size(); ++i) {
        const scene::Star& s = stars[i];
        if (!std::isfinite(s.right_ascension_rad) || !std::isfinite(s.declination_rad) ||
            !std::isfinite(s.magnitude_v) || !std::isfinite(s.colour_b_v.value_or(0)))
            throw ConfigError(fmt::format("stars: star {} has a number that is not finite", i + 1));
        const Vec3 d = star_direction(s.right_ascension_rad, s.declination_rad);
        x_.push_back(d.x);
        y_.push_back(d.y);
        z_.push_back(d.z);
        const StarBins spectrum = star_spectrum(s);
        for (const StarBins& weights : weights_um)
            irradiance_.push_back(star_irradiance_w_m2(s, spectrum, weights));
    }
}

void StarField::inside(Vec3 axis, double half_angle_rad, std::vector<std::uint32_t>& stars) const {
    if (half_angle_rad >= std::numbers::pi) half_angle_rad = std::numbers::pi;
    const double limit = std::cos(half_angle_rad) - 1e-12;
    for (std::size_t i = 0; i < x_.size(); ++i)
        if (x_[i] * axis.x + y_[i] * axis.y + z_[i] * axis.z >= limit)
            stars.push_back(static_cast<std::uint32_t>(i));
}

} // namespace obscura::renderer
