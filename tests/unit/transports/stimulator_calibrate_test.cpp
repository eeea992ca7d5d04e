// SPDX-License-Identifier: Apache-2.0
// Calibration on a simulated bench: a screen with a gamma, uneven light and dead pixels, seen through a
// tilted, distorting and vignetting camera with noise. What is found is compared with what was put in, and
// the optical stage with the table found must make the camera see the scene.
#include "core/error.hpp"
#include "core/philox.hpp"
#include "tests/support/catch.hpp"
#include "transports/stimulator/calibrate.hpp"
#include "transports/stimulator/optical.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>

namespace stimulator_calibrate_test {

using namespace obscura;
using namespace obscura::transports;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

/// The truth. It knows the way from camera to screen, the calibration looks for the other one.
struct Bench {
    std::int32_t cw = 320, ch = 256, sw = 400, sh = 320;
    Homography to_screen;         // undistorted camera pixel -> screen pixel
    double k1 = 0, k2 = 0;        // radial distortion, of the distance from the centre in half widths
    double gamma = 2.2, leak = 0; // luminance = leak + (1 - leak) (level / top)^gamma
    double vignetting = 0.25, tilt_light = 0.1;
    double noise_dn = 2, offset_dn = 64, white_dn = 3200;
    std::vector<ScreenPixel> dead, stuck;
    std::uint32_t seed = 1;

    // Each camera pixel looks at these screen pixels (3x3 samples of its area, a little blurred), -1: none.
    static constexpr int sub = 4;
    std::vector<std::int32_t> looks;
    std::vector<float> response;
    std::vector<std::uint8_t> state; // of screen pixels: 0 good, 1 dead, 2 stuck bright

    [[nodiscard]] PixelPoint screen_at(double u, double v) const {
        const double cx = (cw - 1) / 2.0, cy = (ch - 1) / 2.0, s = cw / 2.0;
        const double x = (u - cx) / s, y = (v - cy) / s, r2 = x * x + y * y;
        const double f = 1 + k1 * r2 + k2 * r2 * r2;
        return to_screen({cx + s * x * f, cy + s * y * f});
    }
    void prepare() {
        looks.clear();
        response.clear();
        state.assign(static_cast<std::size_t>(sw * sh), 0);
        for (const ScreenPixel& p : dead)
            state[static_cast<std::size_t>(p.y * sw + p.x)] = 1;
        for (const ScreenPixel& p : stuck)
            state[static_cast<std::size_t>(p.y * sw + p.x)] = 2;
        for (std::int32_t v = 0; v < ch; ++v) {
            for (std::int32_t u = 0; u < cw; ++u) {
                for (int j = 0; j < sub; ++j) {
                    for (int i = 0; i < sub; ++i) {
                        const double blur = 1.2; // the point spread, as a box
                        const PixelPoint p =
                            screen_at(u + blur * ((i + 0.5) / sub - 0.5), v + blur * ((j + 0.5) / sub - 0.5));
                        const auto x = static_cast<std::int32_t>(std::lround(p.x)),
                                   y = static_cast<std::int32_t>(std::lround(p.y));
                        looks.push_back(x >= 0 && y >= 0 && x < sw && y < sh ? y * sw + x : -1);
                    }
                }
                const double x = (u - cw / 2.0) / (cw / 2.0), y = (v - ch / 2.0) / (cw / 2.0);
                response.push_back(static_cast<float>(1 - vignetting * (x * x + y * y)));
            }
        }
    }
    [[nodiscard]] double screen_light(std::int32_t x) const { // the backlight is brighter on one side
        return 1 - tilt_light * x / sw;
    }
    [[nodiscard]] std::vector<float> luminance(const std::vector<std::uint16_t>& levels, int top) const {
        std::vector<float> light(levels.size());
        for (std::size_t i = 0; i < levels.size(); ++i) {
            double value = leak + (1 - leak) * std::pow(levels[i] / static_cast<double>(top), gamma);
            if (state[i] == 1) value = leak;
            if (state[i] == 2) value = 1;
            light[i] = static_cast<float>(
                value * screen_light(static_cast<std::int32_t>(i % static_cast<std::size_t>(sw))));
        }
        return light;
    }
    /// Digital numbers of the camera, before noise.
    [[nodiscard]] std::vector<float> look(const std::vector<float>& light) const {
        std::vector<float> out(response.size());
        for (std::size_t i = 0; i < out.size(); ++i) {
            float sum = 0;
            for (std::size_t k = 0; k < sub * sub; ++k)
                if (const std::int32_t p = looks[i * sub * sub + k]; p >= 0)
                    sum += light[static_cast<std::size_t>(p)];
            out[i] = static_cast<float>(offset_dn + white_dn * response[i] * sum / (sub * sub));
        }
        return out;
    }
    [[nodiscard]] Capture capture(const std::vector<float>& light, std::uint32_t picture) const {
        Capture c{cw, ch, look(light)};
        for (std::size_t i = 0; i < c.pixels.size(); ++i) {
            const auto r = philox4x32({static_cast<std::uint32_t>(i), picture, 0, 0}, {seed, 5});
            // Irwin and Hall's near-Gaussian of four uniforms.
            const double g = (uniform_double(r[0]) + uniform_double(r[1]) + uniform_double(r[2]) +
                              uniform_double(r[3]) - 2) *
                             1.7320508;
            c.pixels[i] = static_cast<float>(std::floor(c.pixels[i] + noise_dn * g + 0.5));
        }
        return c;
    }
    [[nodiscard]] std::map<std::string, Capture> all(const PatternSequence& sequence, bool with_dark) const {
        std::map<std::string, Capture> captures;
        std::uint32_t picture = 0;
        for (const Pattern& p : sequence.patterns())
            captures[p.name] = capture(luminance(sequence.draw(p), sequence.levels() - 1), ++picture);
        if (with_dark)
            captures["dark"] = capture(std::vector<float>(static_cast<std::size_t>(sw * sh), 0), ++picture);
        return captures;
    }
};

Bench random_bench(std::uint32_t seed) {
    const auto r = philox4x32({seed, 0, 0, 0}, {3, 4}), q = philox4x32({seed, 1, 0, 0}, {3, 4});
    const auto within = [](std::uint32_t word, double low, double high) {
        return low + (high - low) * uniform_double(word);
    };
    Bench b;
    b.seed = seed;
    const double angle = within(r[0], -0.05, 0.05), scale = within(r[1], 1.0, 1.15);
    const double c = std::cos(angle) * scale, s = std::sin(angle) * scale;
    // The camera sees most of the screen and a little beside it.
    b.to_screen.h = {c,
                     -s,
                     within(r[2], 5, 30) + (s > 0 ? 10 : 0),
                     s,
                     c,
                     within(r[3], 5, 20) + (s < 0 ? 12 : 0),
                     within(q[0], -6e-5, 6e-5),
                     within(q[1], -6e-5, 6e-5),
                     1};
    b.k1 = within(q[2], -0.04, 0.04);
    b.k2 = within(q[3], -0.01, 0.01);
    b.prepare();
    return b;
}

CalibrationTable run(const std::map<std::string, Capture>& captures, const PatternSequence& sequence,
                     CalibrationReport& report, const CalibrationSettings& settings = {}) {
    return calibrate(
        sequence,
        [&](const std::string& name) {
            const auto found = captures.find(name);
            return found == captures.end() ? nullptr : &found->second;
        },
        settings, report);
}

struct Miss {
    double rms = 0, worst = 0;
};

/// The map found against the truth, wherever the camera sees the screen.
Miss map_error(const Bench& b, const CalibrationTable& t) {
    Miss m;
    int n = 0;
    for (std::int32_t v = 4; v < b.ch - 4; v += 3) {
        for (std::int32_t u = 4; u < b.cw - 4; u += 3) {
            const PixelPoint p = b.screen_at(u, v);
            if (p.x < 3 || p.y < 3 || p.x > b.sw - 4 || p.y > b.sh - 4) continue;
            const PixelPoint c = t.map(p);
            const double e = std::hypot(c.x - u, c.y - v);
            m.rms += e * e;
            m.worst = std::max(m.worst, e);
            ++n;
        }
    }
    m.rms = std::sqrt(m.rms / n);
    return m;
}

} // namespace

TEST_CASE("Gray codes differ in one bit from neighbour to neighbour, and come back") {
    for (std::uint32_t i = 0; i < 5000; ++i) {
        REQUIRE(from_gray(to_gray(i)) == i);
        REQUIRE(__builtin_popcount(to_gray(i) ^ to_gray(i + 1)) == 1);
    }
}

TEST_CASE("The patterns of a sequence are what their names say") {
    const PatternSequence s(40, 20, 256, 17, 8);
    CHECK(s.column_bits() == 6);
    CHECK(s.row_bits() == 5);
    CHECK(s.patterns().size() == 2 + 12 + 10 + 1 + 17);
    // Every pixel's column and row can be read off the code pictures.
    std::vector<std::uint32_t> x(800, 0), y(800, 0);
    for (const Pattern& p : s.patterns()) {
        const auto picture = s.draw(p);
        REQUIRE(picture.size() == 800);
        if (p.kind == Pattern::Kind::column_bit && !p.inverse)
            for (std::size_t i = 0; i < 800; ++i)
                x[i] = x[i] << 1 | (picture[i] == 255 ? 1u : 0u);
        if (p.kind == Pattern::Kind::row_bit && p.inverse)
            for (std::size_t i = 0; i < 800; ++i)
                y[i] = y[i] << 1 | (picture[i] == 0 ? 1u : 0u);
        if (p.name == "ramp_00128")
            for (const auto l : picture)
                REQUIRE(l == 128);
        if (p.kind == Pattern::Kind::dots) {
            CHECK(picture[4 * 40 + 4] == 255); // the middle of the first dot
            CHECK(picture[0] == 0);
        }
    }
    for (std::size_t i = 0; i < 800; ++i) {
        REQUIRE(from_gray(x[i]) == i % 40);
        REQUIRE(from_gray(y[i]) == i / 40);
    }
    // Few levels: a ramp does not repeat a level.
    CHECK(PatternSequence(16, 16, 4, 17, 8).patterns().size() == 2 + 8 + 8 + 1 + 4);
}

TEST_CASE("A simulated bench is recovered") {
    const auto seed = GENERATE(1u, 2u, 3u);
    Bench b = random_bench(seed);
    b.dead = {{200, 100}, {77, 222}, {310, 250}, {150, 160}, {151, 160}};
    b.stuck = {{120, 60}};
    b.prepare();
    const PatternSequence sequence(b.sw, b.sh, 256, 33, 20);
    CalibrationReport report;
    const CalibrationTable t = run(b.all(sequence, seed != 2), sequence, report);

    const Miss m = map_error(b, t);
    INFO("bench " << seed << ": map rms " << m.rms << " worst " << m.worst << " px, homography alone "
                  << report.homography_rms_px << ", residual " << report.residual_rms_px << ", dots "
                  << report.dots_used << "+" << report.dots_rejected);
    CHECK(m.rms < 0.04);
    CHECK(m.worst < 0.35);
    CHECK(report.homography_rms_px > 3 * m.rms); // the distortion map is needed and does its work
    CHECK(report.finest_column_stripe == 1);
    CHECK(report.dots_used > 180);

    const RadiometricCurve curve(256, t.curve);
    double worst = 0;
    for (int level = 0; level < 256; ++level)
        worst = std::max(worst, std::abs(curve.luminance(level) - std::pow(level / 255.0, b.gamma)));
    INFO("curve off by " << worst);
    CHECK(worst < 0.004);

    // Uniformity: ratios of places, as its scale is free.
    double ratio_worst = 0;
    const auto true_response = [&](std::int32_t u, std::int32_t v) {
        return b.response[static_cast<std::size_t>(v * b.cw + u)] *
               b.screen_light(static_cast<std::int32_t>(std::lround(b.screen_at(u, v).x)));
    };
    const double middle = t.uniformity(b.screen_at(160, 128)) / true_response(160, 128);
    for (std::int32_t v = 8; v < b.ch - 8; v += 8) {
        for (std::int32_t u = 8; u < b.cw - 8; u += 8) {
            const PixelPoint p = b.screen_at(u, v);
            if (p.x < 5 || p.y < 5 || p.x > b.sw - 6 || p.y > b.sh - 6) continue;
            ratio_worst = std::max(ratio_worst, std::abs(t.uniformity(p) / true_response(u, v) / middle - 1));
        }
    }
    INFO("uniformity off by " << ratio_worst);
    CHECK(ratio_worst < 0.01);

    std::vector<ScreenPixel> found = t.dead, wanted = b.dead;
    wanted.insert(wanted.end(), b.stuck.begin(), b.stuck.end());
    const auto order = [](const ScreenPixel& a, const ScreenPixel& c) {
        return a.y != c.y ? a.y < c.y : a.x < c.x;
    };
    std::sort(wanted.begin(), wanted.end(), order);
    for (const ScreenPixel& p : found)
        UNSCOPED_INFO("found " << p.x << "," << p.y);
    if (report.dead_pixels_resolved) CHECK(found == wanted);
}

TEST_CASE("With the table found, the camera sees the scene") {
    Bench b = random_bench(4);
    const PatternSequence sequence(b.sw, b.sh, 256, 33, 20);
    CalibrationReport report;
    const CalibrationTable t = run(b.all(sequence, true), sequence, report);
    OpticalSettings s;
    s.screen_width = b.sw, s.screen_height = b.sh, s.sensor_width = b.cw, s.sensor_height = b.ch;
    s.dn_white = 4095;
    OpticalStage stage(s, &t);
    const auto scene = [&](double u, double v) { // a lit ball on black, with a terminator
        const double x = (u - 160) / 90, y = (v - 128) / 90, r2 = x * x + y * y;
        if (r2 >= 1) return 0.0;
        return 0.85 * std::max(0.0, 0.6 * x + 0.8 * std::sqrt(1 - r2));
    };
    std::vector<std::uint16_t> image(static_cast<std::size_t>(b.cw * b.ch));
    for (std::int32_t v = 0; v < b.ch; ++v)
        for (std::int32_t u = 0; u < b.cw; ++u)
            image[static_cast<std::size_t>(v * b.cw + u)] =
                static_cast<std::uint16_t>(std::lround(4095 * scene(u, v)));
    std::vector<float> light(static_cast<std::size_t>(b.sw * b.sh), 0);
    constexpr int frames = 32;
    std::vector<std::uint16_t> levels(light.size());
    for (std::uint64_t frame = 0; frame < frames; ++frame) {
        stage.render(image, {0, 0, b.sw, b.sh}, 0, b.sh, frame, levels);
        const auto one = b.luminance(levels, 255);
        for (std::size_t i = 0; i < light.size(); ++i)
            light[i] += one[i] / frames;
    }
    const auto seen = b.look(light);
    // One number, the brightness of white, is free.
    double product = 0, square = 0;
    std::vector<std::size_t> inner;
    for (std::int32_t v = 50; v < 206; ++v)
        for (std::int32_t u = 80; u < 240; ++u) {
            const double x = (u - 160) / 90.0, y = (v - 128) / 90.0;
            if (std::abs(std::sqrt(x * x + y * y) - 1) < 0.06 || scene(u, v) < 0.02)
                continue; // blur at the limb is the camera's
            const std::size_t i = static_cast<std::size_t>(v * b.cw + u);
            inner.push_back(i);
            product += (seen[i] - b.offset_dn) * image[i];
            square += static_cast<double>(image[i]) * image[i];
        }
    const double k = product / square;
    double sum = 0, worst = 0;
    for (const std::size_t i : inner) {
        const double error = ((seen[i] - b.offset_dn) / k - image[i]) / 4095;
        sum += error * error;
        worst = std::max(worst, std::abs(error));
    }
    const double rms = std::sqrt(sum / static_cast<double>(inner.size()));
    INFO("rms " << rms << ", worst " << worst << " of white");
    CHECK(rms < 0.006);
    CHECK(worst < 0.03);
}

TEST_CASE("The screen's black is measured where there is a dark capture") {
    Bench b = random_bench(5);
    b.leak = 0.03;
    const PatternSequence sequence(b.sw, b.sh, 256, 17, 20);
    CalibrationReport report;
    const CalibrationTable t = run(b.all(sequence, true), sequence, report);
    CHECK_THAT(report.black_to_white, WithinAbs(0.03, 0.001));
    CHECK_THAT(t.curve.front().luminance, WithinAbs(0.03, 0.001));
    CalibrationReport other;
    CHECK(run(b.all(sequence, false), sequence, other).curve.front().luminance == 0);
}

TEST_CASE("A blurred bench keeps the stripes it can resolve") {
    Bench b = random_bench(6);
    b.sw = 1200, b.sh = 960; // three screen pixels to a camera pixel
    for (std::size_t i = 0; i < 6; ++i)
        b.to_screen.h[i] *= 3;
    b.prepare();
    const PatternSequence sequence(b.sw, b.sh, 256, 9, 60);
    CalibrationReport report;
    const CalibrationTable t = run(b.all(sequence, false), sequence, report);
    CHECK(report.finest_column_stripe >= 2);
    CHECK_FALSE(report.dead_pixels_resolved);
    CHECK(map_error(b, t).rms < 0.05);
}

TEST_CASE("Captures that cannot be used are named") {
    Bench b = random_bench(7);
    const PatternSequence sequence(b.sw, b.sh, 256, 9, 20);
    const auto good = b.all(sequence, false);
    const auto refused =
        [&](const std::function<void(std::map<std::string, Capture>&, CalibrationSettings&)>& change) {
            auto captures = good;
            CalibrationSettings settings;
            change(captures, settings);
            CalibrationReport report;
            try {
                (void)run(captures, sequence, report, settings);
            } catch (const InputError& error) {
                return std::string(error.what());
            }
            return std::string();
        };
    using Captures = std::map<std::string, Capture>;
    CHECK(refused([](Captures&, CalibrationSettings&) {}).empty());
    CHECK_THAT(refused([](Captures& c, CalibrationSettings&) { c.erase("row_03_inverse"); }),
               ContainsSubstring("capture 'row_03_inverse' is missing"));
    CHECK_THAT(refused([](Captures& c, CalibrationSettings&) { c["dots"].height = 5; }),
               ContainsSubstring("capture 'dots' has 320x5 pixels, the others have 320x256"));
    CHECK_THAT(refused([](Captures& c, CalibrationSettings&) { c["white"] = c["black"]; }),
               ContainsSubstring("brighter than 'black' by"));
    CHECK_THAT(refused([](Captures&, CalibrationSettings& s) { s.saturation = 2000; }),
               ContainsSubstring("saturated, expose for less"));
    CHECK_THAT(refused([](Captures&, CalibrationSettings& s) {
                   s.camera_width = 640;
                   s.camera_height = 512;
               }),
               ContainsSubstring("the sensor has 640x512"));
    CHECK_THAT(refused([](Captures& c, CalibrationSettings&) { c["column_01"] = c["column_01_inverse"]; }),
               ContainsSubstring("'column_01' cannot be told"));
    CHECK_THAT(refused([](Captures& c, CalibrationSettings&) { c["dots"] = c["black"]; }),
               ContainsSubstring("0 of 320 dots were found"));
    CHECK_THAT(
        refused([](Captures& c, CalibrationSettings&) { std::swap(c["ramp_00064"], c["ramp_00159"]); }),
        ContainsSubstring("darker than the one before"));
    // Random pictures do not crash it either.
    CHECK_FALSE(refused([](Captures& c, CalibrationSettings&) {
                    std::uint32_t n = 0;
                    for (auto& [name, capture] : c)
                        for (float& p : capture.pixels)
                            p = static_cast<float>(philox4x32({++n, 0, 0, 0}, {9, 9})[0] & 4095u);
                }).empty());
}

} // namespace stimulator_calibrate_test
