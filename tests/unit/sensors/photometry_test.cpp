#include "core/solar_spectrum.hpp"
#include "sensors/photometry.hpp"
#include "tests/support/catch.hpp"

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

TEST_CASE("a wide band is weighed with the Sun's spectrum") {
    const std::vector<SpectralPoint> table{{400e-9, 0.2}, {600e-9, 0.6}, {900e-9, 0.1}};
    double electrons = 0;
    for (int nm = 400; nm < 900; nm += 10) {
        const scene::SpectralBand step{nm * 1e-9, (nm + 10) * 1e-9};
        electrons += electrons_per_joule(table, step) * solar_band_irradiance_w_m2(step.from_m, step.to_m);
    }
    CHECK_THAT(electrons_per_joule(table, {400e-9, 900e-9}),
               WithinRel(electrons / solar_band_irradiance_w_m2(400e-9, 900e-9), 1e-5));
}
