// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/spectrum.hpp"

#include "core/solar_spectrum.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Planck's law up to a constant factor.
double black_body(double wavelength_m, double temperature_k) {
    constexpr double c2_m_k = 1.438776877e-2; // second radiation constant, CODATA 2018
    return std::pow(wavelength_m, -5) / std::expm1(c2_m_k / (wavelength_m * temperature_k));
}

} // namespace

double transmission(const SpectralBand& band, double wavelength_m) {
    const auto& table = band.transmission;
    if (table.empty()) return 1;
    if (wavelength_m <= table.front().wavelength_m) return table.front().value;
    if (wavelength_m >= table.back().wavelength_m) return table.back().value;
    const auto above = std::upper_bound(table.begin(), table.end(), wavelength_m,
                                        [](double l, const SpectralPoint& p) { return l < p.wavelength_m; });
    const SpectralPoint& b = *above;
    const SpectralPoint& a = *(above - 1);
    return a.value +
           (b.value - a.value) * (wavelength_m - a.wavelength_m) / (b.wavelength_m - a.wavelength_m);
}

double sun_irradiance_w_m2(const SpectralBand& band) {
    if (band.transmission.empty()) return solar_band_irradiance_w_m2(band.from_m, band.to_m);
    // Midpoint rule: the spectrum is a table in steps of 10 nm, the curve piecewise linear.
    constexpr int steps = 4000;
    const double step = (band.to_m - band.from_m) / steps;
    double sum = 0;
    for (int i = 0; i < steps; ++i) {
        const double from = band.from_m + i * step;
        sum += transmission(band, from + step / 2) * solar_band_irradiance_w_m2(from, from + step);
    }
    return sum;
}

std::array<double, 3> colour_shares(const SpectralBand& band) {
    const double nm = (band.from_m + band.to_m) / 2 * 1e9;
    const double red = std::clamp((nm - 550) / 100, 0.0, 1.0);
    const double blue = std::clamp((550 - nm) / 100, 0.0, 1.0);
    return {red, 1 - red - blue, blue};
}

double colour_temperature_k(double colour_b_v) {
    const double c = 0.92 * std::clamp(colour_b_v, -0.4, 2.5);
    return 4600 * (1 / (c + 1.7) + 1 / (c + 0.62));
}

double star_irradiance_w_m2(double magnitude_v, double colour_b_v, const SpectralBand& band) {
    constexpr double v_wavelength_m = 545e-9;
    constexpr double v_zero_w_m3 = 3.63e-8 * 1e6;
    const double temperature_k = colour_temperature_k(colour_b_v);
    // Simpson's rule: a black body is smooth over a band, but the corners of a transmission curve need more
    // points.
    const int intervals = band.transmission.empty() ? 64 : 2048;
    const double step = (band.to_m - band.from_m) / intervals;
    double sum = 0;
    for (int i = 0; i <= intervals; ++i) {
        const double weight = i == 0 || i == intervals ? 1 : i % 2 == 1 ? 4 : 2;
        const double wavelength = band.from_m + i * step;
        sum += weight * transmission(band, wavelength) * black_body(wavelength, temperature_k);
    }
    const double shape = sum * step / 3 / black_body(v_wavelength_m, temperature_k);
    return v_zero_w_m3 * std::pow(10, -0.4 * magnitude_v) * shape;
}

} // namespace obscura::renderer
