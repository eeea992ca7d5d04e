// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/galaxy.hpp"

#include "ephemeris/stars/star.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

using std::numbers::pi;

/// Regularised lower incomplete gamma function, by its series or continued fraction (Press et al.,
/// Numerical Recipes, sect. 6.2).
double gamma_p(double a, double x) {
    if (!(x > 0)) return 0;
    const double scale = std::exp(a * std::log(x) - x - std::lgamma(a));
    constexpr int max_terms = 1000;
    if (x < a + 1) {
        double term = 1 / a;
        double sum = term;
        for (int n = 1; n < max_terms && term > 1e-15 * sum; ++n) {
            term *= x / (a + n);
            sum += term;
        }
        return sum * scale;
    }
    double b = x + 1 - a;
    double c = 1e300;
    double d = 1 / b;
    double h = d;
    for (int n = 1; n < max_terms; ++n) {
        const double step = -n * (n - a);
        b += 2;
        d = 1 / (step * d + b);
        c = b + step / c;
        h *= d * c;
        if (std::abs(d * c - 1) < 1e-15) break;
    }
    return 1 - h * scale;
}

/// Radius, over the half-light radius, that holds the share `light` of a Sersic profile of index `n`.
double sersic_radius(double n, double light) {
    // x of gamma_p(2 n, x) = share; r / R = (x / b)^n with b for half the light.
    const auto x_of = [&](double share) {
        double low = 0, high = 2 * n + 60;
        for (int i = 0; i < 80; ++i) {
            const double middle = (low + high) / 2;
            (gamma_p(2 * n, middle) < share ? low : high) = middle;
        }
        return (low + high) / 2;
    };
    return std::pow(x_of(light) / x_of(0.5), n);
}

} // namespace

SkyTangents::SkyTangents(double right_ascension_rad, double declination_rad)
    : centre(ephemeris::direction_of(right_ascension_rad, declination_rad)),
      east{-std::sin(right_ascension_rad), std::cos(right_ascension_rad), 0},
      north(cross(centre, east)) {}

std::vector<Vec3> galaxy_points(const scene::SkyObject& galaxy) {
    // Equal shares of the light by radius, the azimuths by the golden angle.
    constexpr int points = 2048;
    constexpr double golden_angle = pi * (3 - 2.2360679774997896964);
    const SkyTangents tangents(galaxy.star.right_ascension_rad, galaxy.star.declination_rad);
    const double c = std::cos(galaxy.position_angle_rad), s = std::sin(galaxy.position_angle_rad);
    const Vec3 major = tangents.north * c + tangents.east * s, minor = tangents.east * c - tangents.north * s;
    std::vector<Vec3> out;
    out.reserve(points);
    for (int i = 0; i < points; ++i) {
        const double radius =
            galaxy.half_light_radius_rad * sersic_radius(galaxy.sersic_index, (i + 0.5) / points);
        const double azimuth = i * golden_angle;
        out.push_back(normalized(
            tangents.centre + (major * std::cos(azimuth) + minor * (galaxy.axis_ratio * std::sin(azimuth))) *
                                  std::tan(std::min(radius, 1.0))));
    }
    return out;
}

} // namespace obscura::renderer
