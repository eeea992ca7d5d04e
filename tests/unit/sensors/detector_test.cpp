// SPDX-License-Identifier: Apache-2.0
#include "core/error.hpp"
#include "sensors/photometry.hpp"
#include "sensors/pixel_noise.hpp"
#include "sensors/sensor.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <thread>

namespace detector_test {

using namespace obscura;
using namespace obscura::sensors;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double aperture_m = 0.02;
const SpectralBand band{500e-9, 600e-9};

SensorDescription sensor() {
    SensorDescription d;
    d.readout.width = d.readout.height = 512;
    d.readout.shutter = Shutter::global;
    d.detector.gain_dn_per_e = 0.08;
    return d;
}

ReadoutPlan plan_of(const SensorDescription& d, Region region, std::int64_t exposure_ns) {
    ReadoutPlan plan;
    const WindowRequest window{region, exposure_ns};
    REQUIRE(plan_readout(d.readout, {&window, 1}, Time{}, plan) == "");
    return plan;
}

// The irradiance that gives `electrons` in `seconds`.
float irradiance(const SensorDescription& d, double electrons, double seconds) {
    const double area = std::numbers::pi / 4 * aperture_m * aperture_m;
    return static_cast<float>(electrons /
                              (seconds * area * electrons_per_joule(d.detector.quantum_efficiency, band)));
}

std::vector<std::uint16_t> shot(const Detector& detector, const ReadoutPlan& plan, float light,
                                std::uint64_t frame, double gain_db = 0) {
    const auto pixels = static_cast<std::size_t>(plan.width) * static_cast<std::size_t>(plan.height);
    const std::vector<float> values(pixels, light);
    std::vector<std::uint16_t> dn(pixels);
    detector.expose(plan, {0, plan.height, plan.width, values}, frame, gain_db, dn);
    return dn;
}

struct Statistics {
    double mean, temporal_variance;
};
// EMVA 1288 release 4, eqs. 22 and 23: mean of two images, variance from their difference.
Statistics statistics(const std::vector<std::uint16_t>& a, const std::vector<std::uint16_t>& b) {
    double sum_a = 0, sum_b = 0, squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        sum_a += a[i];
        sum_b += b[i];
        squares += (double{1} * a[i] - b[i]) * (double{1} * a[i] - b[i]);
    }
    const double n = static_cast<double>(a.size());
    return {(sum_a + sum_b) / (2 * n), squares / (2 * n) - (sum_a - sum_b) * (sum_a - sum_b) / (2 * n * n)};
}

} // namespace

TEST_CASE("photon transfer gives back gain, dark noise and responsivity") {
    const SensorDescription d = sensor();
    const Detector detector(d, {&band, 1}, aperture_m, 42);
    const ReadoutPlan plan = plan_of(d, {0, 0, 512, 512}, 10'000'000);
    const auto dark = statistics(shot(detector, plan, 0, 1), shot(detector, plan, 0, 2));
    const float light = irradiance(d, 30'000, 0.01);
    const auto flat = statistics(shot(detector, plan, light, 3), shot(detector, plan, light, 4));

    const double dark_e = d.detector.dark_current_e_per_s * 0.01;
    CHECK_THAT(dark.mean, WithinAbs(64 + 0.08 * dark_e, 0.005));
    CHECK_THAT(flat.mean - dark.mean, WithinRel(0.08 * 30'000, 1e-3));
    const double gain = (flat.temporal_variance - dark.temporal_variance) / (flat.mean - dark.mean);
    CHECK_THAT(gain, WithinRel(0.08, 0.01));
    const double dark_noise_e = std::sqrt(dark.temporal_variance - 1.0 / 12) / d.detector.gain_dn_per_e;
    CHECK_THAT(dark_noise_e, WithinRel(std::sqrt(8.0 * 8.0 + dark_e), 0.02));

    SensorDescription behind_glass = d;
    behind_glass.detector.transmission = 0.9;
    behind_glass.detector.fill_factor = 0.6;
    const Detector dimmer(behind_glass, {&band, 1}, aperture_m, 42);
    CHECK_THAT(dimmer.electrons_per_s_per_w_m2()[0],
               WithinRel(0.9 * 0.6 * detector.electrons_per_s_per_w_m2()[0], 1e-12));
}

TEST_CASE("each row integrates over its own exposure") {
    SensorDescription d = sensor();
    d.detector.dark_current_e_per_s = 0;
    const Detector detector(d, {&band, 1}, aperture_m, 1);
    ReadoutPlan plan = plan_of(d, {0, 0, 512, 512}, 10'000'000);
    for (std::size_t r = 0; r < 512; ++r)
        plan.rows[r].read = plan.rows[r].reset + static_cast<std::int64_t>(r + 1) * 20'000;
    const auto dn = shot(detector, plan, irradiance(d, 20'000, 0.01), 1);
    for (const std::size_t r : {std::size_t{0}, std::size_t{99}, std::size_t{499}}) {
        double sum = 0;
        for (std::size_t x = 0; x < 512; ++x)
            sum += dn[r * 512 + x];
        const double electrons = 40.0 * static_cast<double>(r + 1);
        const double error = std::sqrt((electrons + 64 + 13) / 512) * 0.08;
        CHECK_THAT(sum / 512, WithinAbs(64 + 0.08 * electrons, 4 * error));
    }
}

TEST_CASE("the signal stops at the full well and at the ADC's ends") {
    SensorDescription d = sensor();
    d.detector.full_well_e = 10'000;
    d.detector.read_noise_e = 0;
    {
        const Detector detector(d, {&band, 1}, aperture_m, 1);
        const ReadoutPlan plan = plan_of(d, {0, 0, 8, 8}, 10'000'000);
        for (const std::uint16_t value : shot(detector, plan, irradiance(d, 1e6, 0.01), 1))
            CHECK(value == 864); // 64 + 0.08 * 10,000
        for (const std::uint16_t value : shot(detector, plan, irradiance(d, 1e6, 0.01), 1, 20))
            CHECK(value == 4095);
    }
    d.detector.offset_dn = 0;
    d.detector.dark_current_e_per_s = 0;
    const Detector detector(d, {&band, 1}, aperture_m, 1);
    for (const std::uint16_t value : shot(detector, plan_of(d, {0, 0, 8, 8}, 10'000'000), 0, 1))
        CHECK(value == 0);
}

TEST_CASE("light that is no number or without end does no harm") {
    const SensorDescription d = sensor();
    const Detector detector(d, {&band, 1}, aperture_m, 1);
    const ReadoutPlan plan = plan_of(d, {0, 0, 4, 4}, 10'000'000);
    CHECK(shot(detector, plan, std::numeric_limits<float>::infinity(), 1)[0] >
          4064 - 10); // full well of 50 ke-
    CHECK(shot(detector, plan, std::numeric_limits<float>::quiet_NaN(), 1)[0] < 64 + 10);
    CHECK(shot(detector, plan, -1, 1)[0] < 64 + 10);
}

TEST_CASE("gain in decibels multiplies signal and noise") {
    const SensorDescription d = sensor();
    const Detector detector(d, {&band, 1}, aperture_m, 5);
    const ReadoutPlan plan = plan_of(d, {0, 0, 512, 512}, 10'000'000);
    const float light = irradiance(d, 5'000, 0.01);
    const auto one = statistics(shot(detector, plan, light, 1), shot(detector, plan, light, 2));
    const auto two = statistics(shot(detector, plan, light, 3, 20 * std::log10(2.0)),
                                shot(detector, plan, light, 4, 20 * std::log10(2.0)));
    CHECK_THAT(two.mean - 64, WithinRel(2 * (one.mean - 64), 1e-3));
    CHECK_THAT(two.temporal_variance - 1.0 / 12, WithinRel(4 * (one.temporal_variance - 1.0 / 12), 0.015));
}

TEST_CASE("the same pixel gets the same number in any band, window and thread") {
    const SensorDescription d = sensor();
    const Detector detector(d, {&band, 1}, aperture_m, 9);
    const ReadoutPlan plan = plan_of(d, {0, 0, 512, 512}, 10'000'000);
    const float light = irradiance(d, 300, 0.01);
    const auto whole = shot(detector, plan, light, 77);

    std::vector<std::uint16_t> banded(whole.size());
    const std::vector<float> values(whole.size(), light);
    std::vector<std::thread> threads;
    for (std::int32_t first = 0; first < 512; first += 100)
        threads.emplace_back([&, first] {
            const std::int32_t rows = std::min(100, 512 - first);
            const auto at = static_cast<std::size_t>(first) * 512, n = static_cast<std::size_t>(rows) * 512;
            detector.expose(plan, {first, rows, 512, {values.data(), n}}, 77, 0, {banded.data() + at, n});
        });
    for (auto& thread : threads)
        thread.join();
    CHECK(banded == whole);

    const auto part = shot(detector, plan_of(d, {100, 200, 50, 60}, 10'000'000), light, 77);
    bool same = true;
    for (std::size_t y = 0; y < 60; ++y)
        for (std::size_t x = 0; x < 50; ++x)
            same = same && part[y * 50 + x] == whole[(y + 200) * 512 + x + 100];
    CHECK(same);
    CHECK(shot(detector, plan, light, 78) != whole);
    CHECK(shot(Detector(d, {&band, 1}, aperture_m, 10), plan, light, 77) != whole);
}

TEST_CASE("impossible detectors are refused by name") {
    using Catch::Matchers::ContainsSubstring;
    const auto refusal = [](auto change) {
        SensorDescription d = sensor();
        change(d.detector);
        try {
            const Detector detector(d, {&band, 1}, aperture_m, 1);
        } catch (const ConfigError& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    CHECK_THAT(refusal([](auto& s) { s.full_well_e = 0; }), ContainsSubstring("full_well_e"));
    CHECK_THAT(refusal([](auto& s) { s.read_noise_e = std::numeric_limits<double>::quiet_NaN(); }),
               ContainsSubstring("read_noise_e"));
    CHECK_THAT(refusal([](auto& s) { s.adc_bits = 17; }), ContainsSubstring("adc_bits"));
    CHECK_THAT(refusal([](auto& s) { s.quantum_efficiency.clear(); }),
               ContainsSubstring("quantum_efficiency"));
    CHECK_THAT(refusal([](auto& s) {
                   s.quantum_efficiency = {{5e-7, 0.5}, {5e-7, 0.6}};
               }),
               ContainsSubstring("wavelength"));
}

TEST_CASE("the noise that is stated for a pixel is that of its digital numbers") {
    SensorDescription d = sensor();
    d.detector.dark_current_e_per_s = 3000;
    d.detector.conversion_gain_v_per_e = 40e-6;
    for (const bool double_sampling : {false, true})
        for (const double gain_db : {0.0, 12.0})
            for (const double electrons : {0.0, 50.0, 2000.0}) {
                d.detector.double_sampling = double_sampling;
                const Detector detector(d, {&band, 1}, aperture_m, 42);
                const ReadoutPlan plan = plan_of(d, {0, 0, 512, 512}, 10'000'000);
                const float light = irradiance(d, electrons, 0.01);
                const auto seen = statistics(shot(detector, plan, light, 1, gain_db),
                                             shot(detector, plan, light, 2, gain_db));
                const double dn_per_e = d.detector.gain_dn_per_e * std::pow(10, gain_db / 20);
                const double stated = pixel_noise(d.detector, gain_db).variance_e2(electrons, 0.01);
                INFO(double_sampling << " " << gain_db << " dB, " << electrons << " e-");
                CHECK_THAT(seen.temporal_variance / (dn_per_e * dn_per_e), WithinRel(stated, 0.02));
            }
}

} // namespace detector_test
