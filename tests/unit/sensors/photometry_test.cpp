// SPDX-License-Identifier: Apache-2.0
#include "core/solar_spectrum.hpp"
#include "sensors/photometry.hpp"
#include "tests/support/catch.hpp"

namespace photometry_test {

using namespace obscura;
using namespace obscura::sensors;
using Catch::Matchers::WithinRel;

TEST_CASE("quantum efficiency is linear between points and held beyond the ends") {
    const std::vector<SpectralPoint> table{{400e-9, 0.2}, {500e-9, 0.4}, {700e-9, 0.1}};
    CHECK(quantum_efficiency(table, 300e-9) == 0.2);
    CHECK_THAT(quantum_efficiency(table, 450e-9), WithinRel(0.3, 1e-12));
    CHECK_THAT(quantum_efficiency(table, 600e-9), WithinRel(0.25, 1e-12));
    CHECK(quantum_efficiency(table, 1e-6) == 0.1);
}

TEST_CASE("a narrow band gives eta lambda / (h c) electrons per joule") {
    // EMVA 1288 release 4, eq. 4: 50.34e24 photons per (J m), that is 1 / (h c).
    const std::vector<SpectralPoint> table{{550e-9, 0.5}};
    CHECK_THAT(electrons_per_joule(table, {549.9e-9, 550.1e-9}), WithinRel(0.5 * 550e-9 * 5.034117e24, 1e-6));
}

TEST_CASE("within one step of the solar table the curve is weighed with lambda alone") {
    // eta = 1e6 lambda / m: integral of 1e6 lambda^2 / (h c) over 500 to 510 nm, analytically.
    const std::vector<SpectralPoint> table{{1e-9, 1e-3}, {1e-6, 1.0}};
    CHECK_THAT(electrons_per_joule(table, {500e-9, 510e-9}),
               WithinRel(1e6 * (132.651e-21 - 125e-21) / (3 * 10e-9) * 5.034116567e24, 1e-6));
}

TEST_CASE("a filter curve counts once, in the light and in its electrons") {
    // Light of the band is what the filter lets through, so its electrons a joule are the ratio of the two
    // integrals. Both by Simpson's rule over each stretch where filter, efficiency and solar table have no
    // corner: another rule, other points than the code's.
    SpectralBand band{500e-9, 700e-9};
    band.transmission = {{500e-9, 0.0}, {540e-9, 0.9}, {620e-9, 0.6}, {660e-9, 0.1}};
    const std::vector<SpectralPoint> efficiency{{400e-9, 0.2}, {600e-9, 0.7}, {800e-9, 0.3}};
    const auto linear = [](const std::vector<SpectralPoint>& p, double l) {
        if (l <= p.front().wavelength_m) return p.front().value;
        for (std::size_t i = 1; i < p.size(); ++i)
            if (l <= p[i].wavelength_m)
                return p[i - 1].value + (p[i].value - p[i - 1].value) * (l - p[i - 1].wavelength_m) /
                                            (p[i].wavelength_m - p[i - 1].wavelength_m);
        return p.back().value;
    };
    constexpr double h = 6.62607015e-34, c = 299'792'458;
    double electrons = 0, energy = 0;
    const auto add = [&](double a, double b) {
        // The Sun's mean over the stretch from the table's own integral.
        const double sun = solar_band_irradiance_w_m2(a, b) / (b - a);
        for (const auto& [at, weight] : {std::pair{a, 1.0}, {(a + b) / 2, 4.0}, {b, 1.0}}) {
            const double through = linear(band.transmission, at) * sun * weight * (b - a) / 6;
            energy += through;
            electrons += through * linear(efficiency, at) * at / (h * c);
        }
    };
    for (int nm = 500; nm < 700; ++nm) // every corner is at a whole number of nanometres
        add(nm * 1e-9, (nm + 1) * 1e-9);
    CHECK_THAT(electrons_per_joule(efficiency, band), WithinRel(electrons / energy, 1e-3));
    // The filter matters: without it the number is another.
    const SpectralBand open{500e-9, 700e-9};
    CHECK(std::abs(electrons_per_joule(efficiency, open) * energy / electrons - 1) > 2e-3);
}

TEST_CASE("a wide band is weighed with the Sun's spectrum") {
    const std::vector<SpectralPoint> table{{400e-9, 0.2}, {600e-9, 0.6}, {900e-9, 0.1}};
    double electrons = 0;
    for (int nm = 400; nm < 900; nm += 10) {
        const SpectralBand step{nm * 1e-9, (nm + 10) * 1e-9};
        electrons += electrons_per_joule(table, step) * solar_band_irradiance_w_m2(step.from_m, step.to_m);
    }
    CHECK_THAT(electrons_per_joule(table, {400e-9, 900e-9}),
               WithinRel(electrons / solar_band_irradiance_w_m2(400e-9, 900e-9), 1e-5));
}

} // namespace photometry_test
