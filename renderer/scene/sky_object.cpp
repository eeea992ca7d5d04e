// SPDX-License-Identifier: Apache-2.0
#include "renderer/scene/sky_object.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <span>

namespace obscura::scene {
namespace {

/// Polynomial in the phase angle in degrees, from the power 0 on.
double polynomial(std::span<const double> coefficients, double x) {
    double sum = 0;
    for (std::size_t i = coefficients.size(); i-- > 0;)
        sum = sum * x + coefficients[i];
    return sum;
}

struct PlanetLaw {
    double colour_b_v; ///< Mallama, Krobusek & Pavlov, Icarus 282, 19 (2017)
    double last_deg;   ///< largest phase angle of `near`
    std::array<double, 7> near, far;
};

/// Mallama & Hilton (2018), eqs. 2 to 17. Jupiter beyond 12 degrees: see phase_magnitude_v().
const PlanetLaw& law_of(Planet planet) {
    static constexpr std::array<PlanetLaw, 8> laws{{
        {0.97, 180, {-0.613, 6.3280e-2, -1.6336e-3, 3.3644e-5, -3.4265e-7, 1.6893e-9, -3.0334e-12}, {}},
        {0.78, 163.7, {-4.384, -1.044e-3, 3.687e-4, -2.814e-6, 8.938e-9}, {236.05828, -2.81914, 8.39034e-3}},
        {0.47, 180, {-3.99, -1.060e-3, 2.054e-4}, {}},
        {1.43, 50, {-1.601, 2.267e-2, -1.302e-4}, {-0.367, -0.02573, 3.445e-4}},
        {0.87, 12, {-9.395, -3.7e-4, 6.16e-4}, {1, -1.507, -0.363, -0.062, 2.809, -1.876}},
        {1.09, 6.5, {-8.95, -3.7e-4, 6.16e-4}, {-8.94, 2.446e-4, 2.672e-4, -1.506e-6, 4.767e-9}},
        {0.50, 3.1, {-7.110}, {-7.110, 6.587e-3, 1.045e-4}},
        {0.39, 1.9, {-7.00}, {-7.00, 7.944e-3, 9.617e-5}},
    }};
    return laws[static_cast<std::size_t>(planet) - 1];
}

} // namespace

double planet_colour_b_v(Planet planet) noexcept {
    return planet == Planet::none ? std::numeric_limits<double>::quiet_NaN() : law_of(planet).colour_b_v;
}

double phase_magnitude_v(const SkyObject& object, double phase_rad) noexcept {
    const double phase_deg = phase_rad * (180 / std::numbers::pi);
    if (object.planet == Planet::none)
        return object.star.magnitude_v + phase_deg * polynomial(object.phase_law_mag, phase_deg);
    const PlanetLaw& law = law_of(object.planet);
    if (phase_deg <= law.last_deg) return polynomial(law.near, phase_deg);
    if (object.planet == Planet::jupiter) {
        constexpr double min_share = 1e-6; // the law's own share of the light at full phase ends at 0
        return -9.428 - 2.5 * std::log10(std::max(min_share, polynomial(law.far, phase_deg / 180)));
    }
    return polynomial(law.far, phase_deg);
}

} // namespace obscura::scene
