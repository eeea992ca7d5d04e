// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/spectrum.hpp"

#include "core/solar_spectrum.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Steps of the midpoint rule over a band: the Sun's spectrum is a table in steps of 10 nm, curves are
/// piecewise linear.
constexpr int spectrum_steps = 4000;

/// Sums `term(wavelength, step)` over the band.
template<typename Term>
double sum_over(const SpectralBand& band, const Term& term) {
    const double step = (band.to_m - band.from_m) / spectrum_steps;
    double sum = 0;
    for (int i = 0; i < spectrum_steps; ++i)
        sum += term(band.from_m + i * step + step / 2, step);
    return sum;
}

} // namespace

double curve_value(std::span<const SpectralPoint> curve, double wavelength_m) {
    if (wavelength_m <= curve.front().wavelength_m) return curve.front().value;
    if (wavelength_m >= curve.back().wavelength_m) return curve.back().value;
    const auto above = std::upper_bound(curve.begin(), curve.end(), wavelength_m,
                                        [](double l, const SpectralPoint& p) { return l < p.wavelength_m; });
    const SpectralPoint& b = *above;
    const SpectralPoint& a = *(above - 1);
    return a.value +
           (b.value - a.value) * (wavelength_m - a.wavelength_m) / (b.wavelength_m - a.wavelength_m);
}

const std::vector<SpectralPoint>& weights_of(const SpectralBand& band) {
    return band.response.empty() ? band.transmission : band.response;
}

double band_weight(const SpectralBand& band, double wavelength_m) {
    const std::vector<SpectralPoint>& weights = weights_of(band);
    return weights.empty() ? 1 : curve_value(weights, wavelength_m);
}

double mean_weight(const SpectralBand& band) {
    return sum_over(band, [&](double at, double step) { return band_weight(band, at) * step; }) /
           (band.to_m - band.from_m);
}

double curve_light(std::span<const SpectralPoint> spectrum, const SpectralBand& band) {
    return sum_over(band, [&](double at, double step) {
        return band_weight(band, at) * curve_value(spectrum, at) * step;
    });
}

double sun_irradiance_w_m2(const SpectralBand& band) {
    if (weights_of(band).empty()) return solar_band_irradiance_w_m2(band.from_m, band.to_m);
    const double step = (band.to_m - band.from_m) / spectrum_steps;
    double sum = 0;
    for (int i = 0; i < spectrum_steps; ++i) {
        const double from = band.from_m + i * step;
        sum += band_weight(band, from + step / 2) * solar_band_irradiance_w_m2(from, from + step);
    }
    return sum;
}

double sunlit_mean(const std::vector<SpectralPoint>& curve, const SpectralBand& band) {
    const double step = (band.to_m - band.from_m) / spectrum_steps;
    double lit = 0;
    double light = 0;
    double passed = 0;
    double all = 0;
    for (int i = 0; i < spectrum_steps; ++i) {
        const double from = band.from_m + i * step;
        const double share = band_weight(band, from + step / 2);
        const double value = curve_value(curve, from + step / 2);
        const double sun = share * solar_band_irradiance_w_m2(from, from + step);
        lit += sun * value;
        light += sun;
        passed += share * value;
        all += share;
    }
    if (light > 0) return lit / light;
    return all > 0 ? passed / all : curve_value(curve, (band.from_m + band.to_m) / 2);
}

std::array<double, 3> colour_shares(const SpectralBand& band) {
    const double nm = (band.from_m + band.to_m) / 2 * 1e9;
    const double red = std::clamp((nm - 550) / 100, 0.0, 1.0);
    const double blue = std::clamp((550 - nm) / 100, 0.0, 1.0);
    return {red, 1 - red - blue, blue};
}

} // namespace obscura::renderer
