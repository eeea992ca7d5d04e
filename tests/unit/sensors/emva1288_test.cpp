// SPDX-License-Identifier: Apache-2.0
#include "sensors/emva1288.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

using namespace obscura::sensors::emva1288;
using Catch::Matchers::WithinRel;

TEST_CASE("a pair of images gives mean and temporal variance, whatever the pattern below") {
    std::mt19937 random(1);
    std::normal_distribution<double> noise(0, 5);
    std::vector<std::uint16_t> a, b;
    for (int i = 0; i < 200'000; ++i) {
        const double fixed = 1000 + i % 100; // a strong pattern, which the difference removes
        a.push_back(static_cast<std::uint16_t>(std::lround(fixed + noise(random))));
        b.push_back(static_cast<std::uint16_t>(std::lround(fixed + 3 + noise(random)))); // and a drift
    }
    const PairStatistics s = pair_statistics(a, b);
    CHECK_THAT(s.mean, WithinRel(1051.0, 1e-4));
    CHECK_THAT(s.variance, WithinRel(25 + 1.0 / 12, 0.015));
}

TEST_CASE("an ideal camera's photon transfer gives back what it was made of") {
    const double eta = 0.55, gain = 0.3, dark_e = 12, full = 20'000;
    std::vector<Level> levels;
    for (int i = 1; i <= 60; ++i) {
        Level l;
        l.photons = i * 750.0;
        const double electrons = eta * l.photons;
        const bool over = electrons > full;
        l.dark = {40, gain * gain * dark_e * dark_e + 1.0 / 12};
        l.bright = {40 + gain * std::min(electrons, full),
                    over ? 1.0 / 12 : l.dark.variance + gain * gain * electrons};
        levels.push_back(l);
    }
    const LinearModel m = evaluate(levels);
    CHECK_THAT(m.gain_dn_per_e, WithinRel(gain, 1e-9));
    CHECK_THAT(m.quantum_efficiency, WithinRel(eta, 1e-9));
    CHECK_THAT(m.dark_noise_e, WithinRel(dark_e, 1e-9));
    CHECK_THAT(m.saturation_e, WithinRel(full, 1e-6));
    CHECK_THAT(m.snr_max_db, WithinRel(20 * std::log10(std::sqrt(full)), 1e-6));
    CHECK(m.linearity_error_percent < 1e-6);
    CHECK(m.fit_range == 0.7);
    levels.resize(3);
    CHECK_THROWS_AS(evaluate(levels), std::invalid_argument);
}

TEST_CASE("a stack separates pattern from noise") {
    std::mt19937 random(2);
    std::normal_distribution<double> noise(0, 10), pattern(0, 4);
    std::vector<double> fixed(100'000);
    for (double& v : fixed)
        v = 500 + pattern(random);
    ImageStack stack(fixed.size());
    for (int k = 0; k < 8; ++k) {
        std::vector<std::uint16_t> image;
        for (const double v : fixed)
            image.push_back(static_cast<std::uint16_t>(std::lround(v + noise(random))));
        stack.add(image);
    }
    CHECK_THAT(stack.temporal_variance(), WithinRel(100 + 1.0 / 12, 0.01));
    CHECK_THAT(stack.spatial_variance(), WithinRel(16.0, 0.03));
    CHECK_THAT(stack.mean(), WithinRel(500.0, 1e-3));
}

TEST_CASE("slope of a line") {
    const std::vector<double> x{0, 1, 2, 5}, y{3, 5, 7, 13};
    CHECK_THAT(slope(x, y), WithinRel(2.0, 1e-12));
}
