// SPDX-License-Identifier: Apache-2.0
#include "sensors/photometry.hpp"

#include "core/solar_spectrum.hpp"

#include <algorithm>

namespace obscura::sensors {
namespace {

// Exact by definition of the SI (2019).
constexpr double planck_j_s = 6.62607015e-34;
constexpr double light_speed_m_s = 299'792'458.0;

} // namespace

double quantum_efficiency(std::span<const SpectralPoint> table, double wavelength_m) {
    if (wavelength_m <= table.front().wavelength_m) return table.front().value;
    if (wavelength_m >= table.back().wavelength_m) return table.back().value;
    const auto above = std::upper_bound(table.begin(), table.end(), wavelength_m,
                                        [](double l, const SpectralPoint& p) { return l < p.wavelength_m; });
    const SpectralPoint& a = *(above - 1);
    const SpectralPoint& b = *above;
    return a.value +
           (b.value - a.value) * (wavelength_m - a.wavelength_m) / (b.wavelength_m - a.wavelength_m);
}

double electrons_per_joule(std::span<const SpectralPoint> table, SpectralBand band) {
    // Midpoint rule: the efficiency is piecewise linear, the spectrum a step function of 10 nm.
    constexpr int steps = 4000;
    double electrons = 0, energy = 0;
    const bool lit = solar_band_irradiance_w_m2(band.from_m, band.to_m) > 0;
    for (int i = 0; i < steps; ++i) {
        const double wavelength = band.from_m + (band.to_m - band.from_m) * (i + 0.5) / steps;
        const double through =
            band.transmission.empty() ? 1 : quantum_efficiency(band.transmission, wavelength);
        const double weight = through * (lit ? solar_spectral_irradiance_w_m3(wavelength) : 1);
        electrons +=
            weight * quantum_efficiency(table, wavelength) * wavelength / (planck_j_s * light_speed_m_s);
        energy += weight;
    }
    return energy > 0 ? electrons / energy : 0;
}

} // namespace obscura::sensors
