// SPDX-License-Identifier: Apache-2.0
// Runs of a sensor: what the run word changes (all temporal noise) and what it leaves alone (fixed patterns).
#include "sensors/fixed_pattern.hpp"
#include "sensors/sensor.hpp"
#include "sensors/streams.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <thread>
#include <vector>

namespace run_word_test {

using namespace obscura;
using namespace obscura::sensors;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double aperture_m = 0.02;
const SpectralBand band{500e-9, 600e-9};
constexpr std::int32_t size = 256;
constexpr std::size_t pixels = std::size_t{size} * size;
using Image = std::vector<std::uint16_t>;

SensorDescription sensor() {
    SensorDescription d;
    d.readout.width = d.readout.height = size;
    d.detector.dark_current_e_per_s = 0;
    d.detector.read_noise_e = 12;
    d.detector.gain_dn_per_e = 0.5;
    d.detector.offset_dn = 500;
    d.detector.adc_bits = 16;
    return d;
}

class Camera {
public:
    explicit Camera(const SensorDescription& d, std::uint32_t run) : detector_(d, {&band, 1}, aperture_m, 7) {
        detector_.begin_run(run);
        const WindowRequest window{{0, 0, size, size}, 10'000'000};
        REQUIRE(plan_readout(d.readout, {&window, 1}, Time{}, plan_) == "");
    }
    /// Frame 3 under uniform light of `electrons` per pixel and exposure.
    [[nodiscard]] Image shoot(double electrons, std::uint64_t frame = 3) const {
        const double per_s = electrons / to_seconds(plan_.rows[0].exposure_ns());
        const std::vector<float> light(pixels,
                                       static_cast<float>(per_s / detector_.electrons_per_s_per_w_m2()[0]));
        Image dn(pixels);
        detector_.expose(plan_, {0, size, size, light}, frame, 0, dn);
        return dn;
    }
    [[nodiscard]] const Detector& detector() const { return detector_; }
    [[nodiscard]] const ReadoutPlan& plan() const { return plan_; }

private:
    Detector detector_;
    ReadoutPlan plan_;
};

double deviation_of_difference(const Image& a, const Image& b) {
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < pixels; ++i) {
        const double d = double{1} * a[i] - b[i];
        sum += d;
        squares += d * d;
    }
    const double n = pixels;
    return std::sqrt(squares / n - sum / n * (sum / n));
}

std::size_t equal_pixels(const Image& a, const Image& b) {
    std::size_t equal = 0;
    for (std::size_t i = 0; i < pixels; ++i)
        equal += a[i] == b[i] ? 1 : 0;
    return equal;
}

// Standard error of a deviation from n normal values, relative, times four.
const double tolerance = 4 / std::sqrt(2.0 * pixels);

} // namespace

TEST_CASE("a light frame minus a dark frame of another run has the noise of both", "[sensors]") {
    for (const double read_noise : {12.0, 40.0}) { // below and above the limit of the combined draw
        SensorDescription d = sensor();
        d.detector.read_noise_e = read_noise;
        d.detector.prnu_local = 0; // a difference of light and dark keeps it
        d.detector.offset_fpn_e = 60;
        const Image light = Camera(d, 1).shoot(900), dark = Camera(d, 2).shoot(0);
        // Shot noise of the light, read noise twice, quantisation twice; the offsets cancel.
        const double k = d.detector.gain_dn_per_e;
        const double expected = std::sqrt(k * k * (900 + 2 * read_noise * read_noise) + 2.0 / 12);
        CHECK_THAT(deviation_of_difference(light, dark), WithinRel(expected, tolerance));
        // In one run the two frames share their random numbers: the reason for the run word.
        CHECK(deviation_of_difference(light, Camera(d, 1).shoot(0)) < 0.95 * expected);
    }
}

TEST_CASE("the difference of two runs has sqrt(2) times the temporal noise", "[sensors]") {
    SensorDescription d = sensor();
    d.detector.prnu_local = 0.05;
    d.detector.dark_current_e_per_s = 2000;
    d.detector.dark_nonuniformity_e_per_s = 1500;
    d.detector.column_fpn_e = 30;
    d.detector.conversion_gain_v_per_e = 50e-6;
    d.detector.row_noise_e = 5;
    const Camera one(d, 41);
    // Temporal noise of one run, from two of its frames.
    const double within = deviation_of_difference(one.shoot(500, 3), one.shoot(500, 4)) / std::sqrt(2.0);
    for (const std::uint32_t run : {0U, 42U, 41U ^ 0x80000000U, 0xFFFFFFFFU}) {
        CAPTURE(run);
        const Image other = Camera(d, run).shoot(500);
        CHECK_THAT(deviation_of_difference(one.shoot(500), other),
                   WithinRel(std::sqrt(2.0) * within, 2 * tolerance));
    }
}

TEST_CASE("the same run word gives the same bytes, another one other bytes, over the same fixed pattern",
          "[sensors]") {
    SensorDescription d = sensor();
    d.detector.prnu_local = 0.02;
    d.detector.dark_current_e_per_s = 50;
    d.detector.dark_nonuniformity_e_per_s = 30;
    d.detector.offset_fpn_e = 10;
    d.detector.stuck_fraction = d.detector.dead_fraction = 0.001;
    const Camera a(d, 5), b(d, 5), c(d, 6);
    CHECK(a.shoot(200) == b.shoot(200));
    CHECK(a.shoot(200) != c.shoot(200));
    CHECK(a.detector().fixed_pattern().response == c.detector().fixed_pattern().response);
    CHECK(a.detector().fixed_pattern().dark_e_per_s == c.detector().fixed_pattern().dark_e_per_s);
    CHECK(a.detector().fixed_pattern().offset_e == c.detector().fixed_pattern().offset_e);
    // Whichever threads expose its bands.
    const Image whole = a.shoot(200);
    const std::vector<float> light(pixels,
                                   static_cast<float>(200 / to_seconds(a.plan().rows[0].exposure_ns()) /
                                                      a.detector().electrons_per_s_per_w_m2()[0]));
    Image banded(pixels);
    std::vector<std::thread> threads;
    for (std::int32_t first = 0; first < size; first += 50)
        threads.emplace_back([&, first] {
            const std::int32_t rows = std::min(50, size - first);
            const auto at = static_cast<std::size_t>(first) * size, n = static_cast<std::size_t>(rows) * size;
            a.detector().expose(a.plan(), {first, rows, size, {light.data() + at, n}}, 3, 0,
                                {banded.data() + at, n});
        });
    for (auto& thread : threads)
        thread.join();
    CHECK(banded == whole);
}

TEST_CASE("every effect that changes from frame to frame changes from run to run", "[sensors]") {
    const auto shares = [](const std::function<void(DetectorSettings&)>& change) {
        SensorDescription d = sensor();
        d.detector.read_noise_e = 0;
        d.detector.gain_dn_per_e = 1;
        d.pixel_pitch_m = 18e-6;
        change(d.detector);
        const Image a = Camera(d, 8).shoot(0), b = Camera(d, 9).shoot(0);
        CHECK(a == Camera(d, 8).shoot(0));
        return static_cast<double>(equal_pixels(a, b)) / pixels;
    };
    CHECK(shares([](DetectorSettings&) {}) == 1); // no noise at all
    CHECK(shares([](auto& s) { s.dark_current_e_per_s = 1e5; }) < 0.02);
    CHECK(shares([](auto& s) { s.read_noise_e = 100; }) < 0.01);
    CHECK(shares([](auto& s) { s.conversion_gain_v_per_e = 1e-6; }) < 0.01);
    CHECK(shares([](auto& s) { s.row_noise_e = 300; }) < 0.02);
    // Two RTS pixels are in the same level with probability 1/2; in the upper level of the dark current, shot
    // noise makes all pixels differ that are not above full well, with 1e5 e- on average.
    CHECK_THAT(shares([](auto& s) { s.follower_rts_fraction = 1, s.follower_rts_e = 1000; }),
               WithinAbs(0.5, 0.01));
    CHECK_THAT(shares([](auto& s) { s.rts_fraction = 1, s.rts_current_e_per_s = 1e7; }),
               WithinAbs(0.25 + 0.25 * std::exp(-0.5), 0.01));
    SensorDescription d = sensor();
    d.pixel_pitch_m = 18e-6;
    d.detector.hit_flux_per_cm2_s = 1e5;
    const Camera a(d, 8), b(d, 9);
    const auto hits_a = a.detector().hits(a.plan(), 3), hits_b = b.detector().hits(b.plan(), 3);
    REQUIRE(!hits_a.empty());
    REQUIRE(!hits_b.empty());
    CHECK(hits_a.front().x_px != hits_b.front().x_px);
    CHECK(hits_a.front().x_px == Camera(d, 8).detector().hits(a.plan(), 3).front().x_px);
}

TEST_CASE("run 0 is the seed's own key, and no two of a million run words share one", "[sensors]") {
    CHECK(run_key(7, 0) == (7 ^ temporal_key));
    std::vector<std::uint64_t> keys;
    for (std::uint32_t i = 0; i < 1'000'000; ++i)
        keys.push_back(run_key(7, i * 4099));
    std::sort(keys.begin(), keys.end());
    CHECK(std::adjacent_find(keys.begin(), keys.end()) == keys.end());
}

} // namespace run_word_test
