// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/stars/star.hpp"

#include "core/units.hpp"

#include <cmath>

namespace obscura::ephemeris {
namespace {} // namespace

Vec3 direction_of(double right_ascension_rad, double declination_rad) {
    const double c = std::cos(declination_rad);
    return {c * std::cos(right_ascension_rad), c * std::sin(right_ascension_rad), std::sin(declination_rad)};
}

Vec3 proper_motion(const CatalogueStar& star) noexcept {
    const Vec3 r = star.direction;
    // Unit vectors towards east and north; at the poles east is +y, as for a right ascension of 0.
    const double rho = std::hypot(r.x, r.y);
    const Vec3 east = rho > 0 ? Vec3{-r.y / rho, r.x / rho, 0} : Vec3{0, 1, 0};
    const Vec3 north = cross(r, east);
    return (east * star.motion_ra_mas_yr + north * star.motion_dec_mas_yr) * milliarcsecond;
}

Vec3 direction_at(const CatalogueStar& star, double years, Vec3 observer_au) noexcept {
    const Vec3 moved =
        star.direction + proper_motion(star) * years - observer_au * (star.parallax_mas * milliarcsecond);
    const double norm = length(moved);
    return norm > 0 ? moved / norm : star.direction;
}

} // namespace obscura::ephemeris
