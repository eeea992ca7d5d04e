// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/spectrum.hpp"

#include "core/solar_spectrum.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
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

} // namespace obscura::renderer
