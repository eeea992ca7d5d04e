// SPDX-License-Identifier: Apache-2.0
// Response of pixels by a model against its formulas: photon transfer, draws, places, blocks, and what is
// refused.
#include "core/error.hpp"
#include "sensors/sensor.hpp"
#include "sensors/sensor_model.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace sensor_model_test {

using namespace obscura;
using namespace obscura::sensors;

namespace {

constexpr double aperture_m = 0.02;
const SpectralBand band{500e-9, 600e-9};
constexpr std::int32_t size = 256;
using Image = std::vector<std::uint16_t>;

const char* const lin_log = R"(
parameter knee 20000;
parameter fold 8000;
scalar collect(scalar charge, scalar x, scalar y)
{
    scalar beyond = max(charge - knee, 0);
    return min(charge, knee) + fold * log(1 + beyond / fold);
}
)";

models::ModelValues model_of(const std::string& text, models::Execution execution = {}) {
    return models::defaults_of(
        models::loaded_model(models::Model::parse("pixel.sns", text), std::move(execution)));
}

/// No effect but shot noise and read noise; 1 DN per electron.
SensorDescription plain() {
    SensorDescription d;
    d.readout.width = d.readout.height = size;
    d.readout.pixel_clock_hz = 100e6;
    d.detector.dark_current_e_per_s = 0;
    d.detector.read_noise_e = 5;
    d.detector.gain_dn_per_e = 1;
    d.detector.offset_dn = 1000;
    d.detector.adc_bits = 16;
    return d;
}
SensorDescription with_model(const std::string& text, SensorDescription d = plain()) {
    d.model = model_of(text);
    return d;
}

struct Camera {
    explicit Camera(const SensorDescription& d, Region window = {0, 0, size, size},
                    Sampling sampling = Sampling::destructive, std::int32_t reads = 1)
        : detector(d, {&band, 1}, aperture_m, 7) {
        const WindowRequest request{window, 10'000'000, sampling, reads};
        REQUIRE(plan_readout(d.readout, {&request, 1}, Time{}, plan) == "");
    }
    [[nodiscard]] float light_for(double electrons) const {
        return static_cast<float>(electrons / to_seconds(plan.rows[0].exposure_ns()) /
                                  detector.electrons_per_s_per_w_m2()[0]);
    }
    /// Exposes the rows in blocks of `rows`.
    Image shoot(const std::vector<float>& light, std::uint64_t frame, std::int32_t rows,
                std::vector<float>* mean = nullptr) {
        const auto width = static_cast<std::size_t>(plan.width);
        Image dn(width * static_cast<std::size_t>(plan.height));
        if (mean != nullptr) mean->resize(dn.size());
        for (std::int32_t first = 0; first < plan.height; first += rows) {
            const std::int32_t count = std::min(rows, plan.height - first);
            const std::size_t at = static_cast<std::size_t>(first) * width;
            const std::size_t n = static_cast<std::size_t>(count) * width;
            ExposureTruth truth;
            if (mean != nullptr) truth.mean_e = std::span(*mean).subspan(at, n);
            detector.expose(plan, {first, count, plan.width, std::span(light).subspan(at, n)}, frame, 0,
                            std::span(dn).subspan(at, n), truth);
        }
        return dn;
    }
    Image flat(double electrons, std::uint64_t frame, std::int32_t rows = size) {
        return shoot(
            std::vector<float>(static_cast<std::size_t>(plan.width * plan.height), light_for(electrons)),
            frame, rows);
    }

    Detector detector;
    ReadoutPlan plan;
};

struct Statistics {
    double mean = 0, variance = 0;
};
/// Over pixels and frames; there are no patterns.
Statistics statistics(Camera& camera, double electrons, int frames = 8) {
    double sum = 0, squares = 0, n = 0;
    for (int frame = 1; frame <= frames; ++frame)
        for (const std::uint16_t dn : camera.flat(electrons, static_cast<std::uint64_t>(frame))) {
            const double v = dn - 1000.0;
            sum += v;
            squares += v * v;
            n += 1;
        }
    const double mean = sum / n;
    return {mean, squares / n - mean * mean};
}

/// Mean and variance of f(q) for q from a Poisson distribution that is normal enough.
Statistics behind(double lambda, const std::function<double(double)>& f) {
    double weights = 0, sum = 0, squares = 0;
    for (double z = -8; z <= 8; z += 0.01) {
        const double w = std::exp(-z * z / 2), v = f(lambda + z * std::sqrt(lambda));
        weights += w;
        sum += w * v;
        squares += w * v * v;
    }
    const double mean = sum / weights;
    return {mean, squares / weights - mean * mean};
}

} // namespace

TEST_CASE("below its knee a lin-log pixel has the bytes of a sensor without it") {
    Camera model(with_model(lin_log)), built_in(plain());
    CHECK(model.flat(15'000, 3) == built_in.flat(15'000, 3));
    CHECK(model.flat(100, 4) == built_in.flat(100, 4));
}

TEST_CASE("photon transfer of a lin-log pixel follows its slope above the knee") {
    Camera camera(with_model(lin_log));
    const auto formula = [](double q) {
        return q < 20'000 ? q : 20'000 + 8000 * std::log(1 + (q - 20'000) / 8000);
    };
    for (const double electrons : {25'000.0, 40'000.0, 100'000.0, 180'000.0}) {
        const Statistics measured = statistics(camera, electrons);
        const double slope = 1 / (1 + (electrons - 20'000) / 8000);
        CAPTURE(electrons);
        CHECK(std::abs(measured.mean / formula(electrons) - 1) < 0.01);
        CHECK(std::abs(measured.mean - behind(electrons, formula).mean) < 1);
        // Rounding to whole numbers adds 1/12.
        CHECK(std::abs(measured.variance / (slope * slope * electrons + 25 + 1.0 / 12) - 1) < 0.01);
    }
}

TEST_CASE("with a model of the charge, noise of the amplifier is not drawn together with it") {
    SensorDescription d = plain();
    d.detector.read_noise_e = 40;
    Camera camera(with_model(lin_log, d));
    for (const double electrons : {40'000.0, 100'000.0}) { // below and above full well
        const double slope = 1 / (1 + (electrons - 20'000) / 8000);
        const Statistics measured = statistics(camera, electrons);
        CHECK(std::abs(measured.variance / (slope * slope * electrons + 1600 + 1.0 / 12) - 1) < 0.01);
    }
}

TEST_CASE("a model before the converter sees noise and black level") {
    SensorDescription d = plain();
    Camera camera(with_model(R"(
        parameter switch_dn 6000;
        parameter ratio 4;
        scalar convert(scalar signal, scalar x, scalar y)
        { return signal < switch_dn ? signal : switch_dn + (signal - switch_dn) / ratio; }
    )",
                             d));
    Camera built_in(d);
    CHECK(camera.flat(3000, 2) == built_in.flat(3000, 2));
    const Statistics above = statistics(camera, 25'000);
    CHECK(std::abs(above.mean - (5000 + 20'000 / 4.0)) < 0.5);
    CHECK(std::abs(above.variance / ((25'000 + 25) / 16.0 + 1.0 / 12) - 1) < 0.01);
}

TEST_CASE("a model of the light comes after blooming and before shot noise") {
    const std::string text = "scalar light(scalar mean, scalar x, scalar y) { return 2 * mean + x; }";
    SensorDescription d = plain();
    d.detector.full_well_e = 10'000;
    d.detector.blooming = 0.4;
    std::vector<float> means, built_in_means;
    std::vector<float> light(static_cast<std::size_t>(size) * size);
    Camera model(with_model(text, d)), built_in(d);
    for (std::size_t i = 0; i < light.size(); ++i)
        light[i] = model.light_for(i % 100 == 7 ? 30'000 : 500);
    (void)model.shoot(light, 1, size, &means);
    (void)built_in.shoot(light, 1, size, &built_in_means);
    double largest = 0;
    for (std::size_t i = 0; i < means.size(); ++i)
        largest = std::max(
            largest, std::abs(static_cast<double>(means[i]) -
                              (2 * static_cast<double>(built_in_means[i]) + static_cast<double>(i % size))));
    CHECK(largest < 0.01);
    const Statistics drawn = [&] {
        Camera flat(with_model("scalar light(scalar mean, scalar x, scalar y) { return 2 * mean; }"));
        return statistics(flat, 4000);
    }();
    CHECK(std::abs(drawn.mean / 8000 - 1) < 0.002);
    CHECK(std::abs(drawn.variance / (8000 + 25 + 1.0 / 12) - 1) < 0.01);
}

TEST_CASE("blocks of rows, windows and instruction sets do not change what a model gives") {
    const std::string text = R"(
        scalar light(scalar mean, scalar x, scalar y) { return mean * (1 + 0.1 * sin(0.1 * x + 0.05 * y)); }
        scalar collect(scalar charge, scalar x, scalar y) { return 30000 * (1 - exp(-charge / 30000)) * (1 + 0.01 * normal(0)) ; }
        scalar convert(scalar signal, scalar x, scalar y) { return signal + 3 * normal(2) + 0.1 * y; }
    )";
    SensorDescription common = plain(); // the same exposure for all windows
    common.readout.shutter = Shutter::global;
    Camera camera(with_model(text, common));
    const Image whole = camera.flat(20'000, 5);
    for (const std::int32_t rows : {1, 7, 100})
        CHECK(camera.flat(20'000, 5, rows) == whole);

    SensorDescription interpreted = common;
    interpreted.model = model_of(text, models::NativeTarget::none);
    CHECK(Camera(interpreted).flat(20'000, 5) == whole);

    const Region part{35, 21, 170, 60};
    Camera windowed(with_model(text, common), part);
    Image cut;
    for (std::int32_t y = part.y; y < part.y + part.height; ++y)
        cut.insert(cut.end(), whole.begin() + y * size + part.x,
                   whole.begin() + y * size + part.x + part.width);
    CHECK(windowed.flat(20'000, 5) == cut);
}

TEST_CASE("draws of a model are normal, independent of each other, and new in each frame") {
    SensorDescription d = plain();
    d.detector.read_noise_e = 0;
    const std::string first =
        "scalar convert(scalar signal, scalar x, scalar y) { return 5000 + 100 * normal(0); }";
    const std::string second =
        "scalar convert(scalar signal, scalar x, scalar y) { return 5000 + 100 * normal(1); }";
    const std::string third =
        "scalar convert(scalar signal, scalar x, scalar y) { return 5000 + 100 * normal(7); }";
    std::vector<Image> images;
    for (const std::string& text : {first, second, third})
        images.push_back(Camera(with_model(text, d)).flat(0, 1));
    images.push_back(Camera(with_model(first, d)).flat(0, 2));
    const auto n = static_cast<double>(images[0].size());
    for (const Image& image : images) {
        double sum = 0, squares = 0, cubes = 0;
        for (const std::uint16_t dn : image) {
            const double z = (dn - 5000.0) / 100;
            sum += z;
            squares += z * z;
            cubes += z * z * z;
        }
        CHECK(std::abs(sum / n) < 5 / std::sqrt(n));
        CHECK(std::abs(squares / n - 1) < 5 * std::sqrt(2 / n));
        CHECK(std::abs(cubes / n) < 5 * std::sqrt(15 / n));
    }
    for (std::size_t a = 0; a < images.size(); ++a)
        for (std::size_t b = 0; b < a; ++b) {
            double product = 0;
            for (std::size_t i = 0; i < images[a].size(); ++i)
                product += (images[a][i] - 5000.0) * (images[b][i] - 5000.0) / 1e4;
            CHECK(std::abs(product / n) < 5 / std::sqrt(n));
        }
}

TEST_CASE("reads of a ramp and of a non-destructive series are compressed one by one") {
    const auto formula = [](double q) {
        return q < 20'000 ? q : 20'000 + 8000 * std::log(1 + (q - 20'000) / 8000);
    };
    Camera series(with_model(lin_log), {0, 0, size, 64}, Sampling::non_destructive, 4);
    const auto last = static_cast<std::size_t>(series.plan.windows.back().image_y);
    const auto light = static_cast<float>(45'000 / to_seconds(series.plan.rows[last].exposure_ns()) /
                                          series.detector.electrons_per_s_per_w_m2()[0]);
    const Image dn = series.shoot(
        std::vector<float>(static_cast<std::size_t>(series.plan.width * series.plan.height), light), 1,
        series.plan.height);
    for (std::size_t w = 0; w < series.plan.windows.size(); ++w) {
        const auto row = static_cast<std::size_t>(series.plan.windows[w].image_y);
        const double expected = static_cast<double>(light) * series.detector.electrons_per_s_per_w_m2()[0] *
                                to_seconds(series.plan.rows[row].exposure_ns());
        double sum = 0;
        for (std::size_t x = 0; x < size; ++x)
            sum += dn[row * size + x] - 1000.0;
        CAPTURE(w, expected);
        CHECK(std::abs(sum / size - formula(expected)) < 2 + 5 * std::sqrt(expected / size));
    }
    Camera ramp(with_model(lin_log), {0, 0, size, 64}, Sampling::ramp, 4);
    Camera linear(plain(), {0, 0, size, 64}, Sampling::ramp, 4);
    CHECK(ramp.flat(18'000, 1) == linear.flat(18'000, 1));
    CHECK(ramp.flat(100'000, 1) != linear.flat(100'000, 1));
}

TEST_CASE("values that are no charge count as none and are counted") {
    Camera camera(with_model(R"(
        scalar collect(scalar charge, scalar x, scalar y)
        { return x == 3 ? M_NAN : x == 5 ? -charge - 1 : x == 9 ? 1 / (y - y) : charge; }
    )"));
    const Image dn = camera.flat(10'000, 1);
    CHECK(camera.detector.values_replaced() == 3 * size);
    CHECK(std::abs(dn[3] - 1000) < 40);
    CHECK(std::abs(dn[5] - 1000) < 40);
    CHECK(dn[9] == 65535);
    CHECK(std::abs(dn[4] - 11'000) < 1000);
    Camera sound(with_model(lin_log));
    (void)sound.flat(10'000, 1);
    CHECK(sound.detector.values_replaced() == 0);
}

TEST_CASE("models that are not finite, or bend a sensor twice, are refused; odd ones are told") {
    const auto refusal = [](const SensorDescription& d) {
        try {
            const Detector detector(d, {&band, 1}, aperture_m, 7);
        } catch (const ConfigError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK(refusal(with_model(
              "scalar collect(scalar charge, scalar x, scalar y) { return log(1e5 - charge); }")) ==
          "pixel.sns:1:8: collect() is not finite for 100065 e- in pixel (0, 0)");
    const std::string root = "scalar light(scalar mean, scalar x, scalar y) { return mean; }\n"
                             "scalar convert(scalar signal, scalar x, scalar y) { return sqrt(signal); }";
    CHECK(refusal(with_model(root)).empty());
    SensorDescription black = plain();
    black.detector.offset_dn = 0;
    CHECK(refusal(with_model(root, black)) ==
          "pixel.sns:2:8: convert() is not finite for -30 DN in pixel (0, 0)");
    SensorDescription bent = with_model(lin_log);
    bent.detector.nonlinearity[1] = 0.01;
    CHECK(
        refusal(bent) ==
        "pixel.sns: collect() stands in place of full well and non-linearity: set nonlinearity_1 to nonlinearity_4 to 0");
    CHECK(refusal(
              with_model("scalar light(scalar mean, scalar x, scalar y) { return mean * normal(mean); }")) ==
          "pixel.sns:1:63: normal() takes a whole number from 0 to 7 that stands in the text");
    CHECK(refusal(with_model("scalar light(scalar mean, scalar x, scalar y) { return mean * normal(8); }"))
              .ends_with("normal() takes a whole number from 0 to 7 that stands in the text"));
    SensorDescription slow = plain();
    models::Execution execution;
    execution.max_ns = 1e-6;
    slow.model = model_of(lin_log, execution);
    CHECK(refusal(slow).find("models.max_ns_per_evaluation") != std::string::npos);

    const auto told = [](const std::string& text) { return sensor_model_warnings(with_model(text)); };
    CHECK(told(lin_log).empty());
    CHECK(
        told("scalar collect(scalar charge, scalar x, scalar y) { return min(charge, full_well); }").empty());
    const std::vector<std::string> gain = told(
        "scalar collect(scalar charge, scalar x, scalar y) { return charge * 1.5 + (x == 255 ? 1 : 0); }");
    REQUIRE(gain.size() == 1);
    CHECK(
        gain[0] ==
        "sensor: pixel.sns: collect() gives more charge than comes in for 200000 e- in pixel (255, 0): 300001 e-");
    const std::vector<std::string> fall =
        told("scalar light(scalar mean, scalar x, scalar y) { return mean < 1e5 ? mean : 2e5 - mean; }");
    REQUIRE(fall.size() == 1);
    CHECK(fall[0].starts_with("sensor: pixel.sns: light() falls from "));
    CHECK(fall[0].ends_with(" to 0 e- for 200000 e- in pixel (0, 0)"));
    const std::vector<std::string> negative =
        told("scalar light(scalar mean, scalar x, scalar y) { return mean - 100; }");
    REQUIRE(negative.size() == 1);
    CHECK(negative[0] ==
          "sensor: pixel.sns: light() is negative for 0 e- in pixel (0, 0): -100 e-, which counts as 0");
}

} // namespace sensor_model_test
