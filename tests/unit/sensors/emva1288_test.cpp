// SPDX-License-Identifier: Apache-2.0
#include "sensors/emva1288.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace emva1288_test {

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

TEST_CASE("a pair of images gives the variance of the pattern without that of the noise") {
    std::mt19937 random(2);
    std::normal_distribution<double> noise(0, 5), pattern(0, 3);
    std::vector<std::uint16_t> a, b;
    for (int i = 0; i < 200'000; ++i) {
        const double fixed = 1000 + pattern(random);
        a.push_back(static_cast<std::uint16_t>(std::lround(fixed + noise(random))));
        b.push_back(static_cast<std::uint16_t>(std::lround(fixed + noise(random))));
    }
    CHECK_THAT(pair_statistics(a, b).spatial_variance, WithinRel(9.0, 0.02));
    // Without noise it is the variance over the pixels.
    CHECK_THAT(pair_statistics(std::vector<std::uint16_t>{1, 2, 6}, std::vector<std::uint16_t>{1, 2, 6})
                   .spatial_variance,
               WithinRel(7.0, 1e-12));
}

TEST_CASE("the total signal-to-noise ratio is limited by the response's nonuniformity") {
    LinearModel m;
    m.gain_dn_per_e = 0.5, m.quantum_efficiency = 0.5;
    m.dark_noise.electrons = 3;
    // 100 e-: variance 100 of photons, 9 of the dark signal, (1/12) / 0.25 of quantisation.
    CHECK_THAT(model_snr(m, 200), WithinRel(100 / std::sqrt(109 + 1.0 / 3), 1e-12));
    // 4^2 e-^2 of DSNU, (2 % of 100 e-)^2 of PRNU.
    CHECK_THAT(model_snr(m, 200, {4, 0.02}), WithinRel(100 / std::sqrt(109 + 1.0 / 3 + 16 + 4), 1e-12));
    CHECK_THAT(model_snr(m, 1e12, {4, 0.02}), WithinRel(50.0, 1e-6));
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
    const LinearModel m = evaluate(levels, Method::full_well);
    CHECK_THAT(m.gain_dn_per_e, WithinRel(gain, 1e-9));
    CHECK_THAT(m.quantum_efficiency, WithinRel(eta, 1e-9));
    CHECK_THAT(m.dark_noise.electrons, WithinRel(dark_e, 1e-9));
    CHECK_THAT(m.saturation_e, WithinRel(full, 1e-6));
    CHECK_THAT(m.snr_max_db, WithinRel(20 * std::log10(std::sqrt(full)), 1e-6));
    // The threshold of sensitivity has a signal-to-noise ratio of 1, quantisation included.
    const double threshold_e = std::sqrt(dark_e * dark_e + 1.0 / 12 / (gain * gain)) + 0.5;
    CHECK_THAT(m.threshold_photons, WithinRel(threshold_e / eta, 1e-6));
    CHECK_THAT(m.dynamic_range_db, WithinRel(20 * std::log10(full / threshold_e), 1e-6));
    CHECK(m.linearity_error_percent < 1e-6);
    CHECK(m.fit_range == 0.7);
    // The standard takes the level of the largest variance, the last one below the full well.
    const LinearModel standard = evaluate(levels, Method::standard);
    CHECK(standard.saturation_photons == 36'000);
    CHECK_THAT(standard.saturation_e, WithinRel(eta * 36'000, 1e-9));
    CHECK_THAT(standard.saturation_signal_dn, WithinRel(gain * eta * 36'000, 1e-9));
    CHECK_THAT(standard.gain_dn_per_e, WithinRel(gain, 1e-9));
    CHECK_THAT(evaluate(levels, Method::standard, 25 + 1.0 / 12).dark_noise.electrons,
               WithinRel(5 / gain, 1e-9));
    levels.resize(3);
    CHECK_THROWS_AS(evaluate(levels, Method::standard), std::invalid_argument);
}

TEST_CASE("saturation is the absolute maximum of the photon transfer curve") {
    // The variance falls between two maxima, as it does where a camera switches its gain.
    const double variances[] = {10, 20, 30, 40, 25, 45, 60, 30, 1};
    std::vector<Level> levels;
    for (const double v : variances)
        levels.push_back({100.0 * static_cast<double>(levels.size() + 1),
                          {100.0 * static_cast<double>(levels.size() + 1), v + 1},
                          {0, 1}});
    CHECK(evaluate(levels, Method::standard).saturation_photons == 700);
    // Levels of equal irradiation, from different exposure times, are as good as others.
    levels.insert(levels.begin() + 2, levels[2]);
    CHECK(evaluate(levels, Method::standard).saturation_photons == 700);
    CHECK_THROWS_AS(evaluate(levels, Method::full_well), std::invalid_argument);
}

TEST_CASE("dark noise below 0.24 DN^2 is given as an upper limit") {
    CHECK(!dark_noise(0.25, 0.1).upper_limit);
    CHECK_THAT(dark_noise(0.25, 0.1).electrons, WithinRel(std::sqrt(0.25 - 1.0 / 12) / 0.1, 1e-12));
    const DarkNoise limited = dark_noise(0.23, 0.1);
    CHECK(limited.upper_limit);
    CHECK(limited.dn == 0.49);
    CHECK_THAT(limited.electrons, WithinRel(0.40 / 0.1, 0.011));

    // The threshold takes the limit of the noise; K stays what the bright levels say.
    std::vector<Level> levels;
    for (int i = 1; i <= 20; ++i)
        levels.push_back({200.0 * i, {10 + 10.0 * i, 0.1 + 0.5 * i}, {10, 0.1}});
    const LinearModel m = evaluate(levels, Method::standard);
    CHECK_THAT(m.gain_dn_per_e, WithinRel(0.05, 1e-9));
    CHECK(m.dark_noise.upper_limit);
    CHECK_THAT(m.threshold_photons, WithinRel((0.49 / 0.05 + 0.5) / m.quantum_efficiency, 1e-9));

    // Without any level above the limit there is no K.
    for (Level& l : levels)
        l.bright.variance = 0.1 + 0.001 * l.photons / 200;
    CHECK_THROWS_AS(evaluate(levels, Method::standard), std::invalid_argument);
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

TEST_CASE("the variance of a pattern is split into that of columns, rows and pixels") {
    constexpr std::size_t width = 300, height = 200;
    std::mt19937 random(4);
    std::normal_distribution<double> normal;
    std::vector<double> columns(width), rows(height), values(width * height);
    for (double& c : columns)
        c = 3 * normal(random);
    for (double& r : rows)
        r = 2 * normal(random);
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = 100 + columns[i % width] + rows[i / width] + 5 * normal(random);
    const auto variance = [](const std::vector<double>& v) {
        double sum = 0, squares = 0;
        for (const double a : v)
            sum += a, squares += a * a;
        const auto n = static_cast<double>(v.size());
        return (squares - sum * sum / n) / (n - 1);
    };
    const SpatialVariances parts = split_variance(values, width);
    // The pixels' part of a row's mean, 5 / sqrt(300), goes with 200 deviations of 2 by chance: 2 % of their
    // variance.
    CHECK_THAT(parts.column, WithinRel(variance(columns), 0.06));
    CHECK_THAT(parts.row, WithinRel(variance(rows), 0.06));
    CHECK_THAT(parts.pixel, WithinRel(25.0, 0.03));
    // Pixels alone leave nothing to columns and rows.
    for (double& v : values)
        v = 5 * normal(random);
    const SpatialVariances flat = split_variance(values, width);
    CHECK(std::abs(flat.column) < 0.05);
    CHECK(std::abs(flat.row) < 0.05);
    CHECK_THAT(flat.pixel, WithinRel(25.0, 0.03));
}

TEST_CASE("slope of a line") {
    const std::vector<double> x{0, 1, 2, 5}, y{3, 5, 7, 13};
    CHECK_THAT(fit_line(x, y).slope, WithinRel(2.0, 1e-12));
    CHECK_THAT(fit_line(x, y).offset, WithinRel(3.0, 1e-12));
}

} // namespace emva1288_test
