// SPDX-License-Identifier: Apache-2.0
// Each effect of the detector on its own, against its formula.
#include "core/error.hpp"
#include "sensors/adc.hpp"
#include "sensors/dark_current.hpp"
#include "sensors/fits_map.hpp"
#include "sensors/fixed_pattern.hpp"
#include "sensors/particle_hits.hpp"
#include "sensors/rts_noise.hpp"
#include "sensors/sample_effects.hpp"
#include "sensors/sensor.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <numeric>
#include <set>

namespace effects_test {

using namespace obscura;
using namespace obscura::sensors;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double aperture_m = 0.02;
const SpectralBand band{500e-9, 600e-9};
constexpr std::int32_t size = 256;
using Image = std::vector<std::uint16_t>;

// No effect but shot noise; 1 DN per electron, so that numbers are electrons.
SensorDescription bare() {
    SensorDescription d;
    d.readout.width = d.readout.height = size;
    d.readout.pixel_clock_hz = 100e6;
    d.detector.dark_current_e_per_s = 0;
    d.detector.read_noise_e = 0;
    d.detector.gain_dn_per_e = 1;
    d.detector.offset_dn = 1000;
    d.detector.adc_bits = 16;
    return d;
}

struct Camera {
    explicit Camera(const SensorDescription& d, std::int64_t exposure_ns = 10'000'000,
                    Sampling sampling = Sampling::destructive, std::int32_t reads = 1)
        : detector(d, {&band, 1}, aperture_m, 7) {
        const WindowRequest window{{0, 0, d.readout.width, d.readout.height}, exposure_ns, sampling, reads};
        REQUIRE(plan_readout(d.readout, {&window, 1}, Time{}, plan) == "");
    }

    [[nodiscard]] std::size_t pixels() const {
        return static_cast<std::size_t>(plan.width) * static_cast<std::size_t>(plan.height);
    }
    [[nodiscard]] float light_for(double electrons) const {
        return static_cast<float>(electrons / to_seconds(plan.rows[0].exposure_ns()) /
                                  detector.electrons_per_s_per_w_m2()[0]);
    }
    Image shoot(const std::vector<float>& light, std::uint64_t frame, const ExposureTruth& truth = {}) {
        Image dn(pixels());
        detector.expose(plan, {0, plan.height, plan.width, light, 0, 0}, frame, 0, dn, truth);
        return dn;
    }
    Image flat(double electrons, std::uint64_t frame) {
        return shoot(std::vector<float>(pixels(), light_for(electrons)), frame);
    }
    std::vector<float> expected(const std::vector<float>& light, std::uint64_t frame = 1) {
        std::vector<float> mean(pixels());
        shoot(light, frame, {mean, {}});
        return mean;
    }

    Detector detector;
    ReadoutPlan plan;
};

double mean_of(const Image& a) {
    return std::accumulate(a.begin(), a.end(), 0.0) / static_cast<double>(a.size());
}
double variance_of(const Image& a) {
    const double m = mean_of(a);
    double sum = 0;
    for (const double v : a)
        sum += (v - m) * (v - m);
    return sum / static_cast<double>(a.size());
}
// Temporal variance of a pixel, from two images (EMVA 1288 release 4, eq. 23).
double temporal_variance(const Image& a, const Image& b) {
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < a.size(); ++i) {
        const double difference = double{1} * a[i] - b[i];
        sum += difference;
        squares += difference * difference;
    }
    const double n = static_cast<double>(a.size());
    return (squares - sum * sum / n) / (2 * n);
}
double rms(const std::vector<float>& map, std::size_t n) {
    double sum = 0, squares = 0;
    for (std::size_t i = 0; i < n; ++i) {
        sum += double{map[i]};
        squares += double{map[i]} * map[i];
    }
    return std::sqrt(squares / static_cast<double>(n) -
                     sum * sum / static_cast<double>(n) / static_cast<double>(n));
}

} // namespace

TEST_CASE("reset noise: sqrt(kTC), halved in variance by a soft reset") {
    SensorDescription d = bare();
    d.detector.conversion_gain_v_per_e = 14.8e-6;
    d.detector.temperature_c = 24.85; // 298 K
    CHECK_THAT(reset_noise_e(d.detector), WithinRel(41.7, 0.002));
    d.detector.reset_mode = ResetMode::soft;
    CHECK_THAT(reset_noise_e(d.detector), WithinRel(29.5, 0.002));
    d.detector.temperature_c = -20.15;
    CHECK_THAT(reset_noise_e(d.detector), WithinRel(27.1, 0.003));
}

TEST_CASE("double sampling doubles reset noise, the difference of two reads has none") {
    SensorDescription d = bare();
    d.detector.read_noise_e = 25.5;
    d.detector.double_sampling = true;
    const auto variance = [&](double gain, Sampling sampling, std::int32_t reads) {
        d.detector.conversion_gain_v_per_e = gain;
        Camera camera(d, 10'000'000, sampling, reads);
        return temporal_variance(camera.flat(200, 1), camera.flat(200, 2)) - 1.0 / 12;
    };
    // C grows with 1 / gain, kTC noise with the root of C: a hundredth of the gain is ten times the noise.
    const double gain = 14.8e-6 * 4;
    d.detector.conversion_gain_v_per_e = gain;
    const double reset = reset_noise_e(d.detector);
    const double tolerance = 4 * std::sqrt(2.0 / (size * size)); // relative, of a variance from two images

    const double without = variance(0, Sampling::destructive, 1),
                 with = variance(gain, Sampling::destructive, 1);
    CHECK_THAT(without, WithinRel(200 + 2 * 25.5 * 25.5, tolerance));
    CHECK_THAT(with - without, WithinAbs(2 * reset * reset, tolerance * (with + without)));

    const double cds = variance(gain, Sampling::cds, 2), cds_ten = variance(gain / 100, Sampling::cds, 2);
    CHECK_THAT(cds, WithinRel(200 + 2 * 25.5 * 25.5, tolerance));
    CHECK(cds == cds_ten); // the same random numbers, and reset noise does not enter
}

TEST_CASE("reset noise and offset are frozen between non-destructive reads") {
    SensorDescription d = bare();
    d.detector.read_noise_e = 5;
    d.detector.offset_fpn_e = 70;
    d.detector.conversion_gain_v_per_e = 14.8e-6;
    Camera camera(d, 30'000'000, Sampling::non_destructive, 4);
    const std::vector<float> light(camera.pixels(), 0.0F);
    const Image all = camera.shoot(light, 3);
    const std::size_t n = size * size;
    const Image first(all.begin(), all.begin() + n), last(all.begin() + 3 * n, all.end());
    const double alone = variance_of(first), reset = reset_noise_e(d.detector);
    CHECK_THAT(alone, WithinRel(25 + 70.0 * 70 + reset * reset, 0.04));
    CHECK_THAT(2 * temporal_variance(first, last),
               WithinRel(2 * 25.0 + 2.0 / 12, 0.04)); // 2 sigma_amp^2 remain
}

TEST_CASE("charge adds up from read to read") {
    Camera camera(bare(), 30'000'000, Sampling::non_destructive, 4);
    const double rate = 1e5; // e-/s
    const Image all = camera.shoot(
        std::vector<float>(camera.pixels(),
                           static_cast<float>(rate / camera.detector.electrons_per_s_per_w_m2()[0])),
        3);
    const std::size_t n = size * size;
    for (std::size_t k = 0; k < 4; ++k) {
        const Image read(all.begin() + static_cast<std::ptrdiff_t>(k * n),
                         all.begin() + static_cast<std::ptrdiff_t>((k + 1) * n));
        const double seconds = to_seconds(camera.plan.rows[k * size].exposure_ns());
        CHECK_THAT(mean_of(read) - 1000, WithinRel(rate * seconds, 0.003));
        CHECK_THAT(variance_of(read),
                   WithinRel(rate * seconds, 0.03)); // Poisson, whatever the number of steps
        for (std::size_t i = 0; k > 0 && i < n; i += 97)
            REQUIRE(all[k * n + i] >= all[(k - 1) * n + i]);
    }
}

TEST_CASE("a ramp fit has the read noise of the closed form") {
    SensorDescription d = bare();
    d.detector.read_noise_e = 40;
    const std::int32_t reads = GENERATE(2, 3, 8);
    Camera camera(d, 30'000'000, Sampling::ramp, reads);
    const double n = reads;
    const Image a = camera.flat(0, 1), b = camera.flat(0, 2);
    // sigma = sigma_amp sqrt(12 (K - 1) / (K (K + 1))) on the total charge.
    CHECK_THAT(temporal_variance(a, b) - 1.0 / 12,
               WithinRel(40.0 * 40 * 12 * (n - 1) / (n * (n + 1)), 0.025));
    CHECK_THAT(mean_of(camera.flat(5000, 3)) - 1000, WithinRel(5000.0, 0.001));
}

TEST_CASE("dark current follows its law over 45 K") {
    SensorDescription d = bare();
    d.detector.dark_reference_c = 25;
    d.detector.dark_current_e_per_s = 5e6;
    const auto mean_at = [&](DarkLaw law, double temperature) {
        d.detector.dark_law = law;
        d.detector.temperature_c = temperature;
        Camera camera(d, 10'000'000);
        return (mean_of(camera.flat(0, 1)) - 1000) / to_seconds(camera.plan.rows[0].exposure_ns());
    };
    d.detector.dark_doubling_k = 7.5;
    CHECK_THAT(mean_at(DarkLaw::doubling, 25) / mean_at(DarkLaw::doubling, -20),
               WithinRel(std::exp2(45 / 7.5), 0.02));
    // Konnik and Welsh's law gives a factor of 77 between 298 and 253 K.
    CHECK_THAT(mean_at(DarkLaw::band_gap, 24.85) / mean_at(DarkLaw::band_gap, -20.15), WithinRel(77.0, 0.02));
}

TEST_CASE("fixed patterns have the spread they are asked for and never change") {
    SensorDescription d = bare();
    d.readout.width = d.readout.height = 512;
    d.detector.prnu_local = 0.008;
    d.detector.prnu_global = 0.018;
    d.detector.dark_current_e_per_s = 190;
    d.detector.dark_nonuniformity_e_per_s = 100;
    d.detector.offset_fpn_e = 70;
    d.detector.column_fpn_e = 14;
    const FixedPattern a(d), b(d);
    const std::size_t n = 512 * 512;
    const auto mean = [&](const std::vector<float>& m) {
        return std::accumulate(m.begin(), m.begin() + static_cast<std::ptrdiff_t>(n), 0.0) /
               static_cast<double>(n);
    };
    CHECK_THAT(mean(a.response), WithinAbs(1, 1e-6));
    CHECK_THAT(rms(a.response, n), WithinRel(std::hypot(0.008, 0.018), 0.01));
    CHECK_THAT(mean(a.dark_e_per_s), WithinRel(190.0, 1e-5));
    CHECK_THAT(rms(a.dark_e_per_s, n), WithinRel(100.0, 0.02));
    CHECK_THAT(rms(a.offset_e, n), WithinRel(std::hypot(70.0, 14.0), 0.02));
    CHECK(a.response == b.response);
    CHECK(a.dark_e_per_s == b.dark_e_per_s);
    d.serial = 2;
    const FixedPattern other(d);
    CHECK((other.response != a.response)); // parentheses: a failure does not print the maps
    CHECK((other.dark_e_per_s != a.dark_e_per_s));
    CHECK((other.offset_e != a.offset_e));

    // The tail: hot pixels stand out, the mean stays.
    d.detector.hot_fraction = 0.01;
    d.detector.hot_current_e_per_s = 20'000;
    const FixedPattern hot(d);
    CHECK_THAT(mean(hot.dark_e_per_s), WithinRel(190.0, 1e-5));
    const auto far = [&](const FixedPattern& p) {
        return std::count_if(p.dark_e_per_s.begin(), p.dark_e_per_s.begin() + n,
                             [](float v) { return v > 2000; });
    };
    CHECK(far(a) < 30);
    CHECK(far(hot) > 500);
}

TEST_CASE("crosstalk spreads charge over 3x3 pixels and is the same in any band") {
    SensorDescription d = bare();
    d.detector.crosstalk_edge = 0.09;
    d.detector.crosstalk_corner = 0.005;
    Camera camera(d);
    CHECK(camera.detector.halo_rows() == 1);
    std::vector<float> light(camera.pixels());
    light[100 * size + 50] = camera.light_for(10'000);
    const std::vector<float> mean = camera.expected(light);
    CHECK_THAT(double{mean[100 * size + 50]}, WithinRel(6200.0, 1e-4));
    CHECK_THAT(double{mean[99 * size + 50]}, WithinRel(900.0, 1e-4));
    CHECK_THAT(double{mean[100 * size + 51]}, WithinRel(900.0, 1e-4));
    CHECK_THAT(double{mean[101 * size + 51]}, WithinRel(50.0, 1e-4));
    CHECK(mean[102 * size + 50] == 0);

    // Uneven light in bands with a halo of one row gives the bytes of the whole image.
    for (std::size_t i = 0; i < light.size(); ++i)
        light[i] = camera.light_for(static_cast<double>(i * 2654435761U % 5000));
    const Image whole = camera.shoot(light, 5);
    Image banded(whole.size());
    for (std::int32_t first = 0; first < size; first += 37) {
        const std::int32_t rows = std::min(37, size - first);
        const std::int32_t above = std::min(1, first), below = std::min(1, size - first - rows);
        const auto at = [&](std::int32_t row) { return static_cast<std::size_t>(row) * size; };
        camera.detector.expose(camera.plan,
                               {first, rows, size,
                                std::span(light).subspan(at(first - above), at(above + rows + below)), above,
                                below},
                               5, 0, std::span(banded).subspan(at(first), at(rows)));
    }
    CHECK(banded == whole);
}

TEST_CASE("charge above full well is clipped and blooms into the neighbours") {
    SensorDescription d = bare();
    d.detector.full_well_e = 10'000;
    d.detector.blooming = 0.4;
    Camera camera(d);
    std::vector<float> light(camera.pixels());
    light[30 * size + 40] = camera.light_for(50'000);
    std::vector<float> mean(camera.pixels());
    std::vector<std::uint8_t> saturated(camera.pixels());
    const Image dn = camera.shoot(light, 1, {mean, saturated});
    CHECK(dn[30 * size + 40] == 11'000);
    CHECK(saturated[30 * size + 40] == 1);
    CHECK(std::count(saturated.begin(), saturated.end(), 1) == 1);
    for (const std::size_t i : {29 * size + 40, 31 * size + 40, 30 * size + 39, 30 * size + 41})
        CHECK_THAT(double{mean[i]}, WithinRel(0.4 / 4 * 40'000, 1e-4));
    CHECK(mean[29 * size + 39] == 0);
}

TEST_CASE("non-linearity bends the signal by its polynomial") {
    SensorDescription d = bare();
    d.detector.full_well_e = 99'000;
    d.detector.nonlinearity = {0, 0, 0.0615, 0.03205};
    d.detector.gain_dn_per_e = 0.5;
    Camera camera(d);
    // 1 % at 50 ke- and 5 % at 82 ke-.
    CHECK_THAT((mean_of(camera.flat(50'000, 1)) - 1000) * 2, WithinRel(49'500.0, 5e-4));
    CHECK_THAT((mean_of(camera.flat(82'000, 1)) - 1000) * 2, WithinRel(77'900.0, 5e-4));
}

TEST_CASE("image lag shows a share of the frame before, until it is forgotten") {
    SensorDescription d = bare();
    d.detector.lag = 0.01;
    Camera camera(d);
    CHECK_THAT(mean_of(camera.flat(40'000, 1)) - 1000, WithinRel(40'000.0, 1e-3));
    CHECK_THAT(mean_of(camera.flat(0, 2)) - 1000, WithinRel(400.0, 2e-3));
    CHECK_THAT(mean_of(camera.flat(0, 3)) - 1000, WithinAbs(4, 0.1));
    camera.flat(40'000, 4);
    camera.detector.forget();
    CHECK(mean_of(camera.flat(0, 5)) == 1000);
    camera.flat(40'000, 6);
    camera.detector.begin_run(1);
    CHECK(mean_of(camera.flat(0, 1)) == 1000);
}

TEST_CASE("particles arrive at their rate and leave their charge where the list says") {
    SensorDescription d = bare();
    d.pixel_pitch_m = 18e-6;
    d.detector.hit_flux_per_cm2_s = 5000;
    Camera camera(d, 50'000'000);
    double count = 0, charge = 0, in_image = 0;
    constexpr int frames = 40;
    const std::vector<float> dark(camera.pixels());
    for (std::uint64_t f = 0; f < frames; ++f) {
        const auto hits = camera.detector.hits(camera.plan, f);
        count += static_cast<double>(hits.size());
        for (const ParticleHit& hit : hits)
            charge += hit.charge_e;
        const std::vector<float> mean = camera.expected(dark, f);
        in_image += std::accumulate(mean.begin(), mean.end(), 0.0);
    }
    const auto& rows = camera.plan.rows;
    const double seconds = to_seconds(rows.back().read - rows.front().reset);
    const double area_cm2 = size * size * 18e-4 * 18e-4;
    const double expected = 5000 * area_cm2 * seconds * frames;
    CHECK_THAT(count, WithinAbs(expected, 4 * std::sqrt(expected)));
    // A row collects only what comes while it integrates.
    const double share = to_seconds(rows[0].exposure_ns()) / seconds;
    CHECK_THAT(in_image, WithinRel(charge * share, 0.05));
    // Mean path through a layer for p(cos) = 2 cos is twice its depth: 1,600 e-, less what the cut takes.
    CHECK_THAT(charge / count, WithinRel(1600.0, 0.1));

    // Bands find their own hits.
    const Image whole = camera.shoot(dark, 3);
    Image banded(whole.size());
    for (std::int32_t first = 0; first < size; first += 50) {
        const std::int32_t count_rows = std::min(50, size - first);
        const auto at = static_cast<std::size_t>(first) * size,
                   n = static_cast<std::size_t>(count_rows) * size;
        camera.detector.expose(camera.plan, {first, count_rows, size, std::span(dark).subspan(at, n), 0, 0},
                               3, 0, std::span(banded).subspan(at, n));
    }
    CHECK(banded == whole);
}

TEST_CASE("particles cross rectangular pixels at the rate of their area and in all directions alike") {
    SensorDescription d = bare();
    d.pixel_pitch_m = 18e-6;
    d.pixel_pitch_y_m = 4.5e-6;
    d.detector.hit_flux_per_cm2_s = 20000;
    Camera camera(d, 50'000'000);
    double count = 0, across_m2 = 0, down_m2 = 0;
    constexpr int frames = 40;
    for (std::uint64_t f = 0; f < frames; ++f)
        for (const ParticleHit& hit : camera.detector.hits(camera.plan, f)) {
            ++count;
            across_m2 += std::pow(hit.dx_px * 18e-6, 2), down_m2 += std::pow(hit.dy_px * 4.5e-6, 2);
            CHECK(std::abs(hit.dy_px) < 48);
        }
    const auto& rows = camera.plan.rows;
    const double seconds = to_seconds(rows.back().read - rows.front().reset);
    const double expected = 20000 * size * size * 18e-4 * 4.5e-4 * seconds * frames;
    CHECK_THAT(count, WithinAbs(expected, 4 * std::sqrt(expected)));
    CHECK(across_m2 > 0);
    CHECK_THAT(down_m2 / across_m2, WithinAbs(1, 0.25)); // long tracks are few
}

TEST_CASE("an RTS process is in either level half of the time and forgets exponentially") {
    constexpr int pixels = 4000, steps = 40;
    double up = 0, product = 0;
    for (std::uint32_t p = 0; p < pixels; ++p)
        for (int s = 0; s < steps; ++s) {
            const double a = rts_is_high(9, p, 2.0, 10.0 * s) ? 1 : -1;
            const double b = rts_is_high(9, p, 2.0, 10.0 * s + 1) ? 1 : -1;
            up += a > 0 ? 1 : 0;
            product += a * b;
        }
    const double n = double{pixels} * steps;
    CHECK_THAT(up / n, WithinAbs(0.5, 0.005));
    CHECK_THAT(product / n, WithinAbs(std::exp(-0.5), 0.01)); // 1 s at a time constant of 2 s
}

TEST_CASE("jumping pixels add their current in one of their levels") {
    SensorDescription d = bare();
    d.detector.rts_fraction = 0.05;
    d.detector.rts_current_e_per_s = 10'000;
    Camera camera(d);
    const std::vector<float> dark(camera.pixels());
    double total = 0;
    for (std::uint64_t f = 0; f < 20; ++f) {
        const std::vector<float> mean = camera.expected(dark, f * 1'000'000);
        total += std::accumulate(mean.begin(), mean.end(), 0.0);
    }
    const double seconds = to_seconds(camera.plan.rows[0].exposure_ns());
    CHECK_THAT(total / 20, WithinRel(0.5 * 0.05 * size * size * 10'000 * seconds, 0.06));
}

TEST_CASE("an amplifier's jumps have two levels in a sample and three in the difference of two") {
    SensorDescription d = bare();
    d.detector.follower_rts_fraction = 0.2;
    d.detector.follower_rts_e = 60;
    constexpr std::uint64_t frames = 40;
    const auto levels_of = [&](Camera& camera) {
        std::vector<std::set<int>> levels(camera.pixels());
        for (std::uint64_t frame = 1; frame <= frames; ++frame) {
            const Image dn = camera.flat(0, frame);
            for (std::size_t i = 0; i < dn.size(); ++i)
                levels[i].insert(dn[i] - 1000);
        }
        return levels;
    };
    Camera one(d), difference(d, 10'000'000, Sampling::cds, 2);
    const auto pixels = follower_rts_pixels(d).items;
    CHECK_THAT(static_cast<double>(pixels.size()),
               WithinAbs(0.2 * size * size, 4 * std::sqrt(0.2 * size * size)));
    double sum = 0;
    for (const FollowerRtsPixel& p : pixels)
        sum += double{p.step_e};
    CHECK_THAT(sum / static_cast<double>(pixels.size()), WithinRel(60.0, 0.04));
    const auto two = levels_of(one), three = levels_of(difference);
    int others = 0, symmetric = 0;
    for (const FollowerRtsPixel& p : pixels) {
        const int step = static_cast<int>(std::lround(p.step_e));
        const std::set<int> allowed{-step, 0, step};
        // Half a number may be rounded either way.
        const auto one_of = [&](int level, int least) {
            return level >= least - 1 && std::min(std::abs(level), std::abs(std::abs(level) - step)) <= 1;
        };
        for (const int level : two[p.pixel])
            others += !one_of(level, 0);
        for (const int level : three[p.pixel])
            others += !one_of(level, -step);
        symmetric += three[p.pixel] == allowed;
    }
    CHECK(others == 0);
    // All of them jump faster than frames come, so nearly all show every level.
    CHECK(symmetric > 0.99 * static_cast<double>(pixels.size()));
    CHECK(std::count_if(two.begin(), two.end(), [](const auto& l) { return l.size() > 1; }) <=
          static_cast<std::ptrdiff_t>(pixels.size()));
}

TEST_CASE("a converter with errors is monotonic and has the widths asked for") {
    SensorDescription d = bare();
    d.detector.adc_bits = 12;
    d.detector.adc_dnl_dn = 0.3;
    d.detector.adc_inl_dn = 5;
    const AdcCurve curve(d);
    std::vector<double> width(4096);
    const auto entries = static_cast<std::size_t>(4096 * curve.steps());
    double bend = 0;
    for (std::size_t i = 0; i < entries; ++i) {
        if (i > 0) REQUIRE(curve.codes()[i] >= curve.codes()[i - 1]);
        width[curve.codes()[i]] += 1 / curve.steps();
        bend = std::max(bend, std::fabs(static_cast<double>(i) / curve.steps() - curve.codes()[i]));
    }
    double squares = 0;
    for (std::size_t c = 1; c < 4095; ++c)
        squares += (width[c] - 1) * (width[c] - 1);
    CHECK_THAT(std::sqrt(squares / 4094), WithinRel(0.3, 0.06));
    CHECK(bend > 4);
    CHECK(bend < 7);
    d.detector.adc_dnl_dn = d.detector.adc_inl_dn = 0;
    CHECK(AdcCurve(d).perfect());
    // Through the detector.
    d.detector.adc_inl_dn = 5;
    d.detector.offset_dn = 2000;
    Camera camera(d);
    const Image dark = camera.flat(0, 1);
    CHECK(variance_of(dark) == 0);
    CHECK(dark[0] == AdcCurve(d).codes()[static_cast<std::size_t>(2000 * curve.steps())]);
    // Errors of next to nothing change no code.
    SensorDescription perfect = bare(), nearly = bare();
    perfect.detector.adc_bits = nearly.detector.adc_bits = 12;
    nearly.detector.adc_inl_dn = 1e-6;
    CHECK(Camera(nearly).flat(1000, 1) == Camera(perfect).flat(1000, 1));
}

TEST_CASE("row and column noise are common to rows and columns") {
    SensorDescription d = bare();
    d.detector.row_noise_e = 20;
    Camera rows(d);
    const Image r = rows.flat(0, 1);
    for (std::size_t x = 1; x < size; ++x)
        REQUIRE(r[5 * size + x] == r[5 * size]);
    CHECK_THAT(std::sqrt(variance_of(r)), WithinRel(20.0, 0.15));
    CHECK(rows.flat(0, 2) != r);
    // It belongs to the row, wherever a band begins.
    Image band_of_rows(10 * size);
    rows.detector.expose(rows.plan, {100, 10, size, std::vector<float>(10 * size), 0, 0}, 1, 0, band_of_rows);
    CHECK(std::equal(band_of_rows.begin(), band_of_rows.end(), r.begin() + 100 * size));
    d = bare();
    d.detector.column_fpn_e = 20;
    Camera columns(d);
    const Image c = columns.flat(0, 1);
    for (std::size_t y = 1; y < size; ++y)
        REQUIRE(c[y * size + 5] == c[5]);
    CHECK(columns.flat(0, 2) == c);
}

TEST_CASE("black rows, defects and the test pattern are where they should be") {
    SensorDescription d = bare();
    d.detector.dark_current_e_per_s = 100'000;
    d.detector.electrical_black_rows = 4;
    d.detector.optical_black_rows = 8;
    {
        Camera camera(d);
        const std::vector<float> mean =
            camera.expected(std::vector<float>(camera.pixels(), camera.light_for(5000)));
        const double dark = 100'000 * to_seconds(camera.plan.rows[0].exposure_ns());
        CHECK(mean[3 * size] == 0);
        CHECK_THAT(double{mean[4 * size]}, WithinRel(dark, 1e-4));
        CHECK_THAT(double{mean[11 * size]}, WithinRel(dark, 1e-4));
        CHECK_THAT(double{mean[12 * size]}, WithinRel(5000 + dark, 1e-4));
    }
    d = bare();
    d.detector.dead_fraction = d.detector.stuck_fraction = 0.01;
    d.detector.dead_rows = 2;
    d.detector.dead_columns = 3;
    Camera camera(d);
    const Image dn = camera.flat(20'000, 1);
    int dead_rows = 0, dead_columns = 0, dead = 0;
    bool in_place = true;
    for (std::size_t y = 0; y < size; ++y) {
        const bool zero = std::all_of(dn.begin() + static_cast<std::ptrdiff_t>(y * size),
                                      dn.begin() + static_cast<std::ptrdiff_t>((y + 1) * size),
                                      [](auto v) { return v == 0; });
        dead_rows += zero ? 1 : 0;
        in_place = in_place && zero == camera.detector.fixed_pattern().dead_row[y];
    }
    CHECK(in_place);
    for (std::size_t x = 0; x < size; ++x) {
        bool all = true;
        for (std::size_t y = 0; y < size; ++y)
            all = all && dn[y * size + x] == 0;
        dead_columns += all ? 1 : 0;
    }
    for (const std::uint16_t v : dn)
        dead += v == 1000 ? 1 : 0;
    CHECK(dead_rows == 2);
    CHECK(dead_columns == 3);
    CHECK_THAT(dead, WithinAbs(0.01 * size * size, 4 * std::sqrt(0.01 * size * size)));
    CHECK_THAT(static_cast<double>(camera.detector.fixed_pattern().stuck.items.size()),
               WithinAbs(0.01 * size * size, 4 * std::sqrt(0.01 * size * size)));

    d = bare();
    d.detector.test_pattern = TestPattern::ramp;
    d.detector.adc_bits = 8;
    d.detector.offset_dn = 0;
    const Image pattern = Camera(d).flat(0, 1);
    CHECK(pattern[200 * size + 100] == (300 & 255));
}

TEST_CASE("smear and parasitic light follow the time rows spend in the light") {
    SensorDescription d = bare();
    d.detector.smear_row_ns = 10'000;
    d.readout.shutter = Shutter::global;
    {
        Camera camera(d);
        CHECK(camera.detector.needs_whole_columns());
        std::vector<float> light(camera.pixels());
        light[100 * size + 50] = camera.light_for(10'000); // in 10 ms: 10 e- in 10 us
        const std::vector<float> mean = camera.expected(light);
        CHECK_THAT(double{mean[7 * size + 50]}, WithinRel(10.0, 1e-4));
        CHECK(mean[7 * size + 51] == 0);
    }
    {
        // A window is smeared by its own columns, not by those of the window before.
        const Detector detector(d, {&band, 1}, aperture_m, 7);
        const std::vector<WindowRequest> windows{{{0, 0, 40, 20}, 10'000'000},
                                                 {{100, 100, 40, 20}, 10'000'000}};
        ReadoutPlan plan;
        REQUIRE(plan_readout(d.readout, windows, Time{}, plan) == "");
        std::vector<float> light(40 * 40), mean(40 * 40);
        std::fill_n(light.begin(), 20 * 40, 1e-9F);
        Image dn(40 * 40);
        detector.expose(plan, {0, plan.height, plan.width, light, 0, 0}, 1, 0, dn, {mean, {}});
        CHECK(mean[19 * 40] > 0);
        CHECK(mean[20 * 40] == 0);
    }
    d.detector.smear_row_ns = 0;
    d.detector.parasitic_light = 1e-3;
    Camera camera(d);
    const std::vector<float> mean =
        camera.expected(std::vector<float>(camera.pixels(), camera.light_for(10'000)));
    const double delay = to_seconds(camera.plan.release[200] - camera.plan.rows[200].read);
    CHECK_THAT(double{mean[200 * size]}, WithinRel(10'000 * (1 + 1e-3 * delay / 0.01), 1e-5));
}

TEST_CASE("maps go out as FITS and come back, broken ones are refused") {
    SensorDescription d = bare();
    d.readout.width = 40;
    d.readout.height = 30;
    d.detector.prnu_local = 0.02;
    d.detector.offset_fpn_e = 50;
    d.detector.dark_current_e_per_s = 9;
    const std::filesystem::path folder = std::filesystem::path(OBSCURA_BINARY_DIR) / "sensor_maps_test";
    std::filesystem::create_directories(folder);
    const FixedPattern drawn(d);
    drawn.write_fits(folder, d);
    SensorDescription measured = d;
    measured.serial = 99;
    measured.detector.response_map = (folder / "response.fits").string();
    measured.detector.offset_map = (folder / "offset_e.fits").string();
    const FixedPattern read(measured);
    CHECK(read.response == drawn.response);
    CHECK(read.offset_e == drawn.offset_e);
    CHECK(read_fits_map(folder / "dark_e_per_s.fits", 40, 30, 0) == std::vector<float>(1200, 9.0F));

    const auto refusal = [&](const std::filesystem::path& file, double least = 0) {
        try {
            static_cast<void>(read_fits_map(file, 40, 30, least));
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string("accepted");
    };
    using Catch::Matchers::ContainsSubstring;
    CHECK_THAT(refusal(folder / "nowhere.fits"), ContainsSubstring("nowhere.fits"));
    CHECK_THAT(refusal(folder / "offset_e.fits"), ContainsSubstring("pixel ("));
    write_fits_map(folder / "small.fits", std::vector<float>(100, 1.0F), 10, 10, "", "too small");
    CHECK_THAT(refusal(folder / "small.fits"), ContainsSubstring("10 x 10"));
    std::filesystem::copy_file(folder / "response.fits", folder / "short.fits",
                               std::filesystem::copy_options::overwrite_existing);
    std::filesystem::resize_file(folder / "short.fits", 4000);
    CHECK_THAT(refusal(folder / "short.fits"), ContainsSubstring("short.fits"));
    std::ofstream(folder / "text.fits") << "not a FITS file";
    CHECK_THAT(refusal(folder / "text.fits"), ContainsSubstring("text.fits"));
    CHECK_THROWS_AS(write_fits_map(folder / "no/such/folder.fits", std::vector<float>(100), 10, 10, "", ""),
                    OutputError);
    std::filesystem::remove_all(folder);
}

TEST_CASE("windows that share pixels read them independently, apart ones as the whole frame does") {
    SensorDescription d = bare();
    d.detector.read_noise_e = 30;
    const Detector detector(d, {&band, 1}, aperture_m, 3);
    ReadoutPlan plan;
    const std::vector<WindowRequest> windows{
        {{10, 10, 40, 20}, 5'000'000}, {{100, 100, 40, 20}, 5'000'000}, {{20, 15, 40, 20}, 5'000'000}};
    REQUIRE(plan_readout(d.readout, windows, Time{}, plan) == "");
    const std::vector<float> dark(static_cast<std::size_t>(plan.width) *
                                  static_cast<std::size_t>(plan.height));
    Image dn(dark.size());
    detector.expose(plan, {0, plan.height, plan.width, dark, 0, 0}, 1, 0, dn);
    const Image whole = Camera(d, 5'000'000).flat(0, 1);
    Detector same(d, {&band, 1}, aperture_m, 3);
    Camera full(d, 5'000'000);
    Image reference(full.pixels());
    same.expose(full.plan, {0, size, size, std::vector<float>(full.pixels()), 0, 0}, 1, 0, reference);
    bool apart = true, again = true;
    for (std::size_t y = 0; y < 20; ++y)
        for (std::size_t x = 0; x < 40; ++x) {
            apart = apart && dn[y * 40 + x] == reference[(10 + y) * size + 10 + x] &&
                    dn[(20 + y) * 40 + x] == reference[(100 + y) * size + 100 + x];
            again = again && dn[(40 + y) * 40 + x] == reference[(15 + y) * size + 20 + x];
        }
    CHECK(apart);
    CHECK(!again);
}

} // namespace effects_test
