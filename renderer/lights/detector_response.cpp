// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/detector_response.hpp"

#include "renderer/lights/spectrum.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

namespace obscura::renderer {
namespace {

/// Wavelengths between which transmission and efficiency are linear, at most 1 nm apart.
std::vector<double> knots_of(const SpectralBand& band, std::span<const SpectralPoint> efficiency) {
    constexpr double max_step_m = 1e-9;
    std::vector<double> edges{band.from_m, band.to_m};
    const auto add = [&](std::span<const SpectralPoint> curve) {
        for (const SpectralPoint& p : curve)
            if (p.wavelength_m > band.from_m && p.wavelength_m < band.to_m) edges.push_back(p.wavelength_m);
    };
    add(band.transmission);
    add(efficiency);
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    std::vector<double> knots{edges.front()};
    for (std::size_t i = 1; i < edges.size(); ++i) {
        const auto steps = std::max(1.0, std::ceil((edges[i] - edges[i - 1]) / max_step_m));
        for (double k = 1; k <= steps; ++k)
            knots.push_back(edges[i - 1] + (edges[i] - edges[i - 1]) * k / steps);
    }
    return knots;
}

std::vector<SpectralPoint> response_of(const SpectralBand& band, std::span<const SpectralPoint> efficiency) {
    std::vector<SpectralPoint> response;
    for (const double wavelength : knots_of(band, efficiency))
        response.push_back(
            {wavelength, band_weight(band, wavelength) * curve_value(efficiency, wavelength) * wavelength});
    SpectralBand weighted = band;
    weighted.response = response;
    const auto light = [](const SpectralBand& b) {
        const double sun = sun_irradiance_w_m2(b);
        return sun > 0 ? sun : mean_weight(b);
    };
    const double all = light(weighted);
    // A detector that converts none of the band leaves it as it is: its electrons are 0 anyway.
    if (!(all > 0)) return {};
    const double scale = light(band) / all;
    for (SpectralPoint& p : response)
        p.value *= scale;
    return response;
}

} // namespace

void set_detector_response(scene::Scene& scene, std::span<const SpectralPoint> quantum_efficiency) {
    const std::vector<SpectralBand> plain = scene.bands;
    for (SpectralBand& band : scene.bands)
        band.response = response_of(band, quantum_efficiency);
    /// Weighs powers in the bands by the spectrum that they have.
    const auto weigh = [&](const std::vector<SpectralPoint>& spectrum, std::vector<double>& powers) {
        if (spectrum.empty()) return;
        for (std::size_t b = 0; b < std::min(powers.size(), plain.size()); ++b) {
            const double all = curve_light(spectrum, plain[b]);
            if (all > 0) powers[b] *= curve_light(spectrum, scene.bands[b]) / all;
        }
    };
    for (scene::Body& body : scene.bodies) {
        weigh(body.emission_spectrum, body.emission_w_m2_sr);
        if (body.colour_curve.empty()) continue;
        body.colour_of_energy = body.colour;
        for (std::size_t b = 0; b < std::min(body.colour.size(), plain.size()); ++b)
            body.colour[b] = sunlit_mean(body.colour_curve, scene.bands[b]);
    }
    for (scene::Lamp& lamp : scene.lamps)
        weigh(lamp.spectrum, lamp.intensity_w_sr);
}

} // namespace obscura::renderer
