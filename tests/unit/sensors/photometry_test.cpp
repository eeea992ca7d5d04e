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

TEST_CASE("a wide band weighs the curve with lambda") {
    // eta = 1e6 lambda / m: integral of 1e6 lambda^2 / (h c) over the band, analytically.
    const std::vector<SpectralPoint> table{{1e-9, 1e-3}, {1e-6, 1.0}};
    CHECK_THAT(electrons_per_joule(table, {400e-9, 800e-9}),
               WithinRel(1e6 * (512e-21 - 64e-21) / (3 * 4e-7) * 5.034116567e24, 1e-6));
}
