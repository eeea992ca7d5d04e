// SPDX-License-Identifier: Apache-2.0
// Electrons of stars, coloured bodies, lamps and glowing bodies: the product of irradiance and electrons per
// joule against sums over wavelength of each source's own spectrum.
#include "core/solar_spectrum.hpp"
#include "renderer/lights/detector_response.hpp"
#include "renderer/lights/spectrum.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/scene/star_catalogue.hpp"
#include "sensors/photometry.hpp"
#include "sensors/sensor_file.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/linear_curve.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <fstream>
#include <functional>

namespace detector_response_test {

using namespace obscura;
using namespace obscura::renderer;
using Catch::Matchers::WithinRel;
using obscura::test::linear;
using Curve = std::vector<SpectralPoint>;

namespace {

/// Electrons a second and m2 of a spectral irradiance, W m-2 per m: sum in steps of 0.02 nm.
double electrons(const Curve& efficiency, const SpectralBand& band,
                 const std::function<double(double)>& spectrum_w_m3) {
    constexpr double planck = 6.62607015e-34, light = 299'792'458, step = 0.02e-9;
    double sum = 0;
    for (double at = band.from_m + step / 2; at < band.to_m; at += step) {
        const double through = band.transmission.empty() ? 1 : linear(band.transmission, at);
        sum += spectrum_w_m3(at) * through * linear(efficiency, at) * at / (planck * light) * step;
    }
    return sum;
}

std::vector<std::pair<std::string, Curve>> shipped_efficiencies() {
    std::vector<std::pair<std::string, Curve>> all;
    for (const auto& entry : std::filesystem::directory_iterator(OBSCURA_SENSORS))
        all.emplace_back(entry.path().filename().string(),
                         sensors::load_sensor(entry.path()).detector.quantum_efficiency);
    return all;
}

std::vector<SpectralBand> bands() {
    SpectralBand filter{543e-9, 557e-9}; // 10 nm wide at half its height
    filter.transmission = {{543e-9, 0.0}, {547e-9, 0.9}, {553e-9, 0.9}, {557e-9, 0.0}};
    return {{400e-9, 900e-9}, {300e-9, 1100e-9}, filter};
}

/// The bands as a renderer of the detector has them.
std::vector<SpectralBand> weighted(const Curve& efficiency) {
    scene::Scene scene;
    scene.bands = bands();
    set_detector_response(scene, efficiency);
    return scene.bands;
}

} // namespace

TEST_CASE("a detector's response leaves sunlight as it is") {
    for (const auto& [name, efficiency] : shipped_efficiencies()) {
        INFO(name);
        const auto plain = bands(), with = weighted(efficiency);
        for (std::size_t b = 0; b < plain.size(); ++b)
            CHECK_THAT(sun_irradiance_w_m2(with[b]), WithinRel(sun_irradiance_w_m2(plain[b]), 1e-12));
    }
}

TEST_CASE("stars of every class have the electrons of their own spectra") {
    for (const auto& [name, efficiency] : shipped_efficiencies()) {
        const auto plain = bands(), with = weighted(efficiency);
        for (std::size_t b = 0; b < plain.size(); ++b)
            for (const StarTemplate& t : star_templates()) {
                scene::Star star;
                star.magnitude_v = 3;
                star.colour_b_v = t.colour_b_v;
                const StarBins flux = star_spectrum(star);
                const double scale = star_v_zero_w_m2_um * 1e6 * std::pow(10, -0.4 * 3);
                const double truth = electrons(efficiency, plain[b], [&](double at) {
                    std::size_t bin = 0;
                    while (bin + 1 < star_bins && at >= star_bin_edge_m(bin + 1))
                        ++bin;
                    return flux[bin] * scale;
                });
                INFO(name << ", band " << b << ", number " << t.number);
                CHECK_THAT(star_irradiance_w_m2(star, with[b]) *
                               sensors::electrons_per_joule(efficiency, plain[b]),
                           WithinRel(truth, b == 2 ? 1e-3 : 1e-2));
            }
    }
}

TEST_CASE("stars have the electrons of the Pickles library's spectra") {
    for (const char* const type : {"O5V", "B0V", "B3V", "B8V", "A0V", "A5V", "F0V", "F5V", "G0V", "G2V",
                                   "G5V", "G8III", "B0I", "F0I", "G2I"}) {
        std::string file_name(type);
        std::transform(file_name.begin(), file_name.end(), file_name.begin(),
                       [](char c) { return static_cast<char>(std::tolower(c)); });
        const auto file = test::data_file("spectra/pickles/" + file_name + ".sed.ext");
        if (!file) continue;
        Curve spectrum;
        std::ifstream in(*file);
        for (double angstrom = 0, flux = 0; in >> angstrom >> flux;)
            if (angstrom < 25000) spectrum.push_back({angstrom * 1e-10, flux});
        REQUIRE(spectrum.size() > 1000);
        scene::Star star;
        star.type = scene::parse_spectral_type(type);
        REQUIRE(star.type);
        const SpectralBand broad{400e-9, 900e-9};
        // Electrons of the QE over those of a flat one: independent of the scale of the library's spectrum.
        const Curve flat{{500e-9, 1.0}};
        const auto of = [&](double at) { return linear(spectrum, at); };
        for (const auto& [name, efficiency] : shipped_efficiencies()) {
            INFO(type << ", " << name);
            const auto product = [&](const Curve& qe) {
                return star_irradiance_w_m2(star, weighted(qe)[0]) * sensors::electrons_per_joule(qe, broad);
            };
            CHECK_THAT(product(efficiency) / product(flat),
                       WithinRel(electrons(efficiency, broad, of) / electrons(flat, broad, of), 0.01));
        }
    }
}

TEST_CASE("bodies, lamps and glowing surfaces have the electrons of their curves") {
    const Curve red{{400e-9, 0.05}, {650e-9, 0.2}, {900e-9, 0.6}};
    const Curve hot{{400e-9, 0.01}, {700e-9, 0.3}, {900e-9, 1.0}};
    for (const auto& [name, efficiency] : shipped_efficiencies()) {
        scene::Scene scene;
        scene.bands = bands();
        scene::Body body;
        body.colour_curve = red;
        for (const SpectralBand& band : scene.bands)
            body.colour.push_back(sunlit_mean(red, band));
        body.emission_w_m2_sr = {2, 2, 2};
        body.emission_spectrum = hot;
        scene.bodies.push_back(body);
        scene::Lamp lamp;
        lamp.intensity_w_sr = {5, 5, 5};
        lamp.spectrum = hot;
        scene.lamps.push_back(lamp);
        const std::vector<SpectralBand> plain = scene.bands;
        set_detector_response(scene, efficiency);
        for (std::size_t b = 0; b < plain.size(); ++b) {
            INFO(name << ", band " << b);
            const double per_joule = sensors::electrons_per_joule(efficiency, plain[b]);
            const double sunlit = electrons(efficiency, plain[b], [&](double at) {
                return solar_spectral_irradiance_w_m3(at) * linear(red, at);
            });
            CHECK_THAT(scene.bodies[0].colour[b] * sun_irradiance_w_m2(scene.bands[b]) * per_joule,
                       WithinRel(sunlit, 1e-3));
            CHECK_THAT(energy_of_response(scene.bodies[0], b) * scene.bodies[0].colour[b],
                       WithinRel(body.colour[b], 1e-12));
            // 5 W/sr in the band, shaped as the spectrum behind the filter.
            const auto shape = [&](double at) { return linear(hot, at); };
            const double watts = [&] {
                double sum = 0;
                for (double at = plain[b].from_m + 0.01e-9; at < plain[b].to_m; at += 0.02e-9)
                    sum += shape(at) *
                           (plain[b].transmission.empty() ? 1 : linear(plain[b].transmission, at)) * 0.02e-9;
                return sum;
            }();
            const double truth = electrons(efficiency, plain[b], shape) / watts;
            CHECK_THAT(scene.lamps[0].intensity_w_sr[b] * per_joule, WithinRel(5 * truth, 1e-3));
            CHECK_THAT(scene.bodies[0].emission_w_m2_sr[b] * per_joule, WithinRel(2 * truth, 1e-3));
        }
    }
}

} // namespace detector_response_test
