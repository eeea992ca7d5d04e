// SPDX-License-Identifier: Apache-2.0
// The optical stage against cases that can be worked out by hand, and through a simulated screen and camera.
#include "core/error.hpp"
#include "core/philox.hpp"
#include "core/time.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"
#include "transports/stimulator/calibration_table.hpp"
#include "transports/stimulator/linear_solve.hpp"
#include "transports/stimulator/optical.hpp"
#include "transports/stimulator/refresh.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>

namespace stimulator_optical_test {

using namespace obscura;
using namespace obscura::transports;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

double random01(std::uint32_t i, std::uint32_t stream = 0) {
    return uniform_double(philox4x32({i, stream, 0, 0}, {11, 12})[0]);
}

/// A homography that tilts, shifts and scales.
const Homography tilted{{1.1, 0.05, 12, -0.04, 1.08, 9, 2e-5, -3e-5, 1}};

std::vector<CurvePoint> gamma_points(int levels, int count, double exponent) {
    std::vector<CurvePoint> points;
    for (int i = 0; i < count; ++i) {
        const double level = std::round((levels - 1.0) * i / (count - 1));
        points.push_back({level, std::pow(level / (levels - 1), exponent)});
    }
    return points;
}

CalibrationTable plain_table(std::int32_t sw, std::int32_t sh, std::int32_t cw, std::int32_t ch) {
    CalibrationTable t;
    t.screen_width = sw, t.screen_height = sh, t.camera_width = cw, t.camera_height = ch;
    return t;
}

OpticalSettings settings_for(const CalibrationTable& t) {
    OpticalSettings s;
    s.screen_width = t.screen_width, s.screen_height = t.screen_height;
    s.sensor_width = t.camera_width, s.sensor_height = t.camera_height;
    s.levels = t.levels;
    s.dn_white = 4095;
    s.dither = Dither::none;
    return s;
}

std::vector<std::uint16_t> render(OpticalStage& stage, const std::vector<std::uint16_t>& image,
                                  std::uint64_t frame = 0, std::int32_t band = 1000) {
    const std::int32_t w = stage.settings().screen_width, h = stage.settings().screen_height;
    std::vector<std::uint16_t> levels(static_cast<std::size_t>(w * h), 0xFFFF);
    for (std::int32_t y = 0; y < h; y += band)
        stage.render(image, {0, 0, w, h}, y, std::min(y + band, h), frame, levels);
    return levels;
}

} // namespace

TEST_CASE("Cholesky's solution of a fit equals the exact one") {
    // A cubic through more points than unknowns, exactly on it.
    NormalEquations<4> equations;
    for (int i = 0; i < 9; ++i) {
        const double x = i * 0.25 - 1;
        equations.add({1, x, x * x, x * x * x}, 2 - 3 * x + 0.5 * x * x + 4 * x * x * x);
    }
    std::array<double, 4> c{};
    REQUIRE(equations.solve(c));
    CHECK_THAT(c[0], WithinAbs(2, 1e-12));
    CHECK_THAT(c[1], WithinAbs(-3, 1e-12));
    CHECK_THAT(c[2], WithinAbs(0.5, 1e-12));
    CHECK_THAT(c[3], WithinAbs(4, 1e-12));
    NormalEquations<2> poor;
    poor.add({1, 1}, 1);
    poor.add({2, 2}, 2);
    std::array<double, 2> none{};
    CHECK_FALSE(poor.solve(none));
}

TEST_CASE("A homography is recovered from the points it maps") {
    std::vector<PixelPoint> from, to;
    for (std::uint32_t i = 0; i < 40; ++i) {
        from.push_back({1200 * random01(i, 1), 900 * random01(i, 2)});
        to.push_back(tilted(from.back()));
    }
    Homography got;
    REQUIRE(fit_homography(from, to, got));
    for (std::size_t i = 0; i < 9; ++i)
        CHECK_THAT(got.h[i], WithinAbs(tilted.h[i], 1e-9));
    // Noise of 0.1 pixels on 40 points leaves a few hundredths.
    for (std::uint32_t i = 0; i < 40; ++i) {
        to[i].x += 0.2 * (random01(i, 3) - 0.5);
        to[i].y += 0.2 * (random01(i, 4) - 0.5);
    }
    REQUIRE(fit_homography(from, to, got));
    CHECK(std::hypot(got({600, 450}).x - tilted({600, 450}).x, got({600, 450}).y - tilted({600, 450}).y) <
          0.05);
    // Points in a line determine nothing.
    for (std::uint32_t i = 0; i < 40; ++i)
        from[i] = {static_cast<double>(i), 2.0 * i}, to[i] = from[i];
    CHECK_FALSE(fit_homography(from, to, got));

    const Homography back = inverse(tilted);
    const PixelPoint p = back(tilted({321, 123}));
    CHECK_THAT(p.x, WithinAbs(321, 1e-9));
    CHECK_THAT(p.y, WithinAbs(123, 1e-9));
}

TEST_CASE("The distortion grid reproduces quadratics exactly and cubics closely") {
    DistortionGrid g;
    g.columns = 12, g.rows = 9, g.x0 = -20, g.y0 = -30, g.step = 40;
    const auto fx = [](double x, double y) { return 1e-5 * x * x - 2e-5 * x * y + 0.01 * y; };
    const auto fy = [](double x, double y) { return 3e-8 * x * x * x + 1e-5 * y * y; };
    for (int r = 0; r < g.rows; ++r) {
        for (int c = 0; c < g.columns; ++c) {
            const double x = g.x0 + c * g.step, y = g.y0 + r * g.step;
            g.du.push_back(static_cast<float>(fx(x, y)));
            g.dv.push_back(static_cast<float>(fy(x, y)));
        }
    }
    for (std::uint32_t i = 0; i < 500; ++i) {
        // One cell from the rim all sixteen nodes are there.
        const double x = 20 + 360 * random01(i, 5), y = 10 + 240 * random01(i, 6);
        const PixelPoint d = g({x, y});
        CHECK_THAT(d.x, WithinAbs(fx(x, y), 1e-5)); // nodes are floats
        CHECK_THAT(d.y,
                   WithinAbs(fy(x, y), 3e-8 * 40 * 40 * 40 * 0.1)); // third order, a tenth of f''' step^3
    }
    ScreenMap map{tilted, g};
    for (std::uint32_t i = 0; i < 50; ++i) {
        const PixelPoint p{400 * random01(i, 7), 280 * random01(i, 8)};
        const PixelPoint back = map.inverse(map(p));
        CHECK_THAT(back.x, WithinAbs(p.x, 1e-6));
        CHECK_THAT(back.y, WithinAbs(p.y, 1e-6));
    }
}

TEST_CASE("The radiometric curve follows its points and its inverse is exact in the mean") {
    for (const int levels : {256, 766, 65536}) {
        const auto points = gamma_points(levels, 33, 2.2);
        const RadiometricCurve curve(levels, points);
        for (const CurvePoint& p : points)
            CHECK_THAT(curve.luminance(static_cast<int>(p.level)), WithinAbs(p.luminance, 1e-6));
        double worst = 0;
        for (int i = 0; i < levels; ++i)
            worst = std::max(worst, std::abs(curve.luminance(i) - std::pow(i / (levels - 1.0), 2.2)));
        CHECK(worst < 5e-4); // 33 points of a gamma curve, monotone cubic between
        for (std::uint32_t i = 0; i < 3000; ++i) {
            const auto wanted = static_cast<float>(random01(i, 9));
            const float drive = curve.drive(wanted);
            const int n = std::min(static_cast<int>(drive), levels - 2);
            const double f = drive - static_cast<float>(n);
            // Dithering between the two levels gives the luminance asked for.
            CHECK_THAT((1 - f) * curve.luminance(n) + f * curve.luminance(n + 1), WithinAbs(wanted, 2e-6));
        }
        CHECK(curve.drive(-1) == 0);
        CHECK(curve.drive(0) == 0);
        CHECK(curve.drive(1) == static_cast<float>(levels - 1));
        CHECK(curve.drive(7) == static_cast<float>(levels - 1));
        CHECK(curve.drive(std::nanf("")) == 0);
    }
    const RadiometricCurve line(256);
    CHECK_THAT(line.drive(0.5F), WithinAbs(127.5, 1e-4));
}

TEST_CASE("A curve with flat parts has an inverse, and one that falls is refused") {
    const std::vector<CurvePoint> flat{{0, 0.1}, {50, 0.1}, {100, 0.5}, {200, 0.5}, {255, 2}};
    const RadiometricCurve curve(256, flat);
    CHECK_THAT(curve.luminance(255), WithinAbs(1, 1e-7)); // scaled
    CHECK_THAT(curve.luminance(25), WithinAbs(0.05, 1e-7));
    CHECK(curve.drive(0.01F) == 0); // darker than the screen can be
    for (int i = 0; i <= 100; ++i) {
        const auto wanted = static_cast<float>(0.05 + 0.0095 * i);
        const float d = curve.drive(wanted);
        const int n = std::min(static_cast<int>(d), 254);
        const double f = d - static_cast<float>(n);
        CHECK_THAT((1 - f) * curve.luminance(n) + f * curve.luminance(n + 1), WithinAbs(wanted, 1e-5));
    }
    const auto refused = [](std::vector<CurvePoint> points) {
        try {
            const RadiometricCurve c(256, points);
        } catch (const ConfigError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK_THAT(refused({{0, 0}}), ContainsSubstring("fewer than 2"));
    CHECK_THAT(refused({{0, 0}, {254, 1}}), ContainsSubstring("0 to 255"));
    CHECK_THAT(refused({{0, 0}, {100, 0.6}, {150, 0.5}, {255, 1}}),
               ContainsSubstring("falls from level 100 to 150"));
    CHECK_THAT(refused({{0, 0}, {150, 0.5}, {150, 0.6}, {255, 1}}),
               ContainsSubstring("level 150 follows 150"));
    CHECK_THAT(refused({{0, 1}, {255, 1}}), ContainsSubstring("no brighter"));
    CHECK_THAT(refused({{0, -1}, {255, 1}}), ContainsSubstring("luminance -1"));
}

TEST_CASE("The ordered-dither matrix holds every value once, in any block") {
    for (const unsigned shift : {0u, 5u}) {
        std::set<unsigned> seen;
        for (unsigned y = 0; y < 16; ++y)
            for (unsigned x = 0; x < 16; ++x)
                seen.insert(bayer16((x + shift) & 15u, (y + 3 * shift) & 15u));
        CHECK(seen.size() == 256);
    }
    // Bayer's 2x2 matrix 0 2 / 3 1 at its coarsest.
    CHECK(bayer16(0, 0) / 64 == 0);
    CHECK(bayer16(1, 0) / 64 == 2);
    CHECK(bayer16(0, 1) / 64 == 3);
    CHECK(bayer16(1, 1) / 64 == 1);
    std::set<unsigned> turns;
    for (std::uint64_t f = 512; f < 768; ++f)
        turns.insert(reversed8(f));
    CHECK(turns.size() == 256);
}

TEST_CASE("Dithering keeps the mean, over a block in one frame and over 256 frames in one pixel") {
    CalibrationTable t = plain_table(32, 32, 32, 32);
    for (const double wanted : {0.37, 100.0 / 255, 0.001, 0.9987}) {
        const std::vector<std::uint16_t> image(32 * 32,
                                               static_cast<std::uint16_t>(std::lround(wanted * 65535)));
        OpticalSettings s = settings_for(t);
        s.dn_white = 65535;
        const double level = image[0] / 65535.0 * 255;

        s.dither = Dither::both;
        OpticalStage both(s, nullptr);
        for (const std::uint64_t frame : {0u, 1u, 77u}) {
            const auto levels = render(both, image, frame);
            double sum = 0;
            for (std::size_t y = 0; y < 16; ++y)
                for (std::size_t x = 0; x < 16; ++x)
                    sum += levels[32 * y + x];
            CHECK_THAT(sum / 256, WithinAbs(level, 0.5 / 256 + 1e-4));
        }
        for (const Dither mode : {Dither::both, Dither::temporal}) {
            s.dither = mode;
            OpticalStage stage(s, nullptr);
            std::vector<double> sums(32 * 32, 0);
            for (std::uint64_t frame = 1000; frame < 1256; ++frame) {
                const auto levels = render(stage, image, frame);
                for (std::size_t i = 0; i < sums.size(); ++i)
                    sums[i] += levels[i];
            }
            for (const double sum : sums)
                REQUIRE_THAT(sum / 256, WithinAbs(level, 0.5 / 256 + 1e-4));
        }
        s.dither = Dither::none;
        OpticalStage none(s, nullptr);
        for (const auto l : render(none, image))
            REQUIRE(l == static_cast<std::uint16_t>(std::lround(level)));
        // The same frame, the same levels.
        s.dither = Dither::both;
        OpticalStage again(s, nullptr);
        CHECK(render(again, image, 5) == render(both, image, 5));
    }
}

TEST_CASE("Bands give the levels that the whole gives") {
    CalibrationTable t = plain_table(61, 47, 70, 60);
    t.map.homography = tilted;
    t.dead = {{3, 0}, {10, 10}, {10, 11}, {60, 46}, {30, 15}, {30, 16}};
    OpticalSettings s = settings_for(t);
    s.dither = Dither::both;
    std::vector<std::uint16_t> image(70 * 60);
    for (std::uint32_t i = 0; i < image.size(); ++i)
        image[i] = static_cast<std::uint16_t>(4096 * random01(i, 20));
    OpticalStage whole(s, &t), bands(s, &t);
    for (const std::int32_t band : {1, 3, 16, 46})
        CHECK(render(whole, image, 9) == render(bands, image, 9, band));
}

TEST_CASE("A window's place on the screen is where its pixels change, and no pixel outside of it does") {
    CalibrationTable t = plain_table(80, 60, 90, 70);
    t.map.homography = tilted;
    t.dead = {{40, 30}};
    OpticalSettings s = settings_for(t);
    OpticalStage stage(s, &t);
    std::vector<std::uint16_t> image(90 * 70, 1000);
    const auto before = render(stage, image);
    const Region window{40, 30, 20, 12};
    for (std::int32_t y = window.y; y < window.y + window.height; ++y)
        for (std::int32_t x = window.x; x < window.x + window.width; ++x)
            image[static_cast<std::size_t>(y * 90 + x)] = 3000;
    const Region place = stage.screen_region(window);
    const auto after = render(stage, image);
    std::size_t inside = 0;
    for (std::int32_t y = 0; y < 60; ++y)
        for (std::int32_t x = 0; x < 80; ++x)
            if (const auto i = static_cast<std::size_t>(y * 80 + x); before[i] != after[i]) {
                ++inside;
                REQUIRE(Region{x, y, 1, 1}.inside(place));
            }
    CHECK(inside > 150);
    CHECK(place.width < 26);
    CHECK(place.height < 20);
    // Rendering that part alone gives the same picture.
    auto levels = before;
    OpticalStage partial(s, &t);
    std::vector<std::uint16_t> old(90 * 70, 1000);
    partial.render(old, {0, 0, 80, 60}, 0, 60, 0, levels);
    partial.render(image, place, place.y, place.y + place.height, 0, levels);
    CHECK(levels == after);
    CHECK(stage.screen_region({0, 0, 1, 1}).width == 0); // the camera's corner sees no screen
}

TEST_CASE("Uniformity is evened out up to the weakest place, or clipped and counted at a higher peak") {
    CalibrationTable t = plain_table(64, 48, 64, 48);
    UniformityGrid& g = t.uniformity;
    g.columns = 5, g.rows = 4, g.x0 = -8, g.y0 = -8, g.step = 20;
    for (int r = 0; r < g.rows; ++r)
        for (int c = 0; c < g.columns; ++c)
            g.values.push_back(1.0F - 0.1F * static_cast<float>(c) - 0.05F * static_cast<float>(r));
    OpticalSettings s = settings_for(t);
    s.levels = t.levels = 65536;
    OpticalStage stage(s, &t);
    const double weakest = t.uniformity({63, 47});
    CHECK_THAT(stage.peak(), WithinAbs(weakest, 1e-9));
    const std::vector<std::uint16_t> image(64 * 48, 2048);
    const auto levels = render(stage, image);
    for (std::int32_t y = 0; y < 48; ++y)
        for (std::int32_t x = 0; x < 64; ++x) {
            const double seen = levels[static_cast<std::size_t>(y * 64 + x)] / 65535.0 *
                                t.uniformity({static_cast<double>(x), static_cast<double>(y)});
            REQUIRE_THAT(seen, WithinAbs(2048.0 / 4095 * weakest, 1e-5));
        }
    CHECK(stage.clipped() == 0);
    s.peak = 1;
    OpticalStage bright(s, &t);
    const std::vector<std::uint16_t> white(64 * 48, 4095);
    (void)render(bright, white);
    CHECK(bright.clipped() > 60 * 48);
}

TEST_CASE("Dead pixels hand their light to their neighbours: none is lost") {
    CalibrationTable t = plain_table(20, 20, 20, 20);
    t.levels = 65536;
    t.dead = {{5, 5}, {10, 10}, {11, 10}, {0, 0}, {19, 7}};
    OpticalStage stage(settings_for(t), &t);
    std::vector<std::uint16_t> image(400);
    for (std::uint32_t i = 0; i < 400; ++i)
        image[i] = static_cast<std::uint16_t>(100 + 1500 * random01(i, 30));
    const auto levels = render(stage, image);
    std::vector<std::uint8_t> dead(400, 0);
    for (const ScreenPixel& p : t.dead)
        dead[static_cast<std::size_t>(20 * p.y + p.x)] = 1;
    double wanted = 0, shown = 0;
    for (std::size_t i = 0; i < 400; ++i) {
        wanted += image[i] / 4095.0;
        shown += dead[i] != 0 ? 0 : levels[i] / 65535.0;
    }
    CHECK_THAT(shown, WithinAbs(wanted, 400 * 0.5 / 65535));
    // (5,4) gets a quarter of (5,5).
    CHECK_THAT(levels[20 * 4 + 5] / 65535.0,
               WithinAbs((image[20 * 4 + 5] + image[20 * 5 + 5] / 4.0) / 4095, 1e-5));
    // (10,10) has three live neighbours.
    CHECK_THAT(levels[20 * 10 + 9] / 65535.0,
               WithinAbs((image[20 * 10 + 9] + image[20 * 10 + 10] / 3.0) / 4095, 1e-5));
}

TEST_CASE("A star keeps its light when the screen is coarser or finer than the camera") {
    // Sum over the screen of luminance times the camera pixels that a screen pixel covers = the star's own
    // sum.
    for (const double scale : {0.5, 1.0, 1.7, 3.3}) { // camera pixels per screen pixel
        const auto side = static_cast<std::int32_t>(120 / scale);
        CalibrationTable t = plain_table(side, side, 120, 120);
        t.levels = 65536;
        t.map.homography.h = {scale, 0, 0.13, 0, scale, 0.29, 0, 0, 1};
        OpticalStage stage(settings_for(t), &t);
        for (std::uint32_t i = 0; i < 12; ++i) {
            const bool spread = i % 2 == 1;
            std::vector<std::uint16_t> image(120 * 120, 0);
            const double sx = 20 + 80 * random01(i, 40), sy = 20 + 80 * random01(i, 41);
            double wanted = 0;
            for (std::size_t y = 0; y < 120; ++y) {
                for (std::size_t x = 0; x < 120; ++x) {
                    const double dx = static_cast<double>(x) - sx, dy = static_cast<double>(y) - sy;
                    const double value = spread ? 4000 * std::exp(-(dx * dx + dy * dy) / (2 * 0.7 * 0.7))
                                                : (std::abs(dx) <= 0.5 && std::abs(dy) <= 0.5 ? 4000 : 0);
                    image[120 * y + x] = static_cast<std::uint16_t>(std::lround(value));
                    wanted += image[120 * y + x] / 4095.0;
                }
            }
            double sum = 0;
            for (const auto l : render(stage, image))
                sum += l / 65535.0;
            CHECK_THAT(sum * scale * scale / wanted, WithinAbs(1, spread ? 0.01 : 0.05));
        }
    }
}

TEST_CASE("Through screen and camera the scene comes back") {
    // A screen with gamma 2.2 and vignetting, tilted and distorted, 1.6 pixels to a camera pixel. The camera
    // integrates it over its pixel by brute force; what it sees must be the scene it was meant to see.
    constexpr std::int32_t sw = 208, sh = 176, cw = 96, ch = 80;
    CalibrationTable t = plain_table(sw, sh, cw, ch);
    t.map.homography.h = {0.55, 0.02, -8, -0.015, 0.56, -6, 3e-5, -2e-5, 1};
    DistortionGrid& g = t.map.distortion;
    g.columns = 15, g.rows = 13, g.x0 = -16, g.y0 = -16, g.step = 16;
    const auto bend = [](double x, double y) { // barrel, about a pixel at the rim
        const double dx = (x - 104) / 104, dy = (y - 88) / 104, r2 = dx * dx + dy * dy;
        return PixelPoint{1.2 * dx * r2, 1.2 * dy * r2};
    };
    for (int r = 0; r < g.rows; ++r)
        for (int c = 0; c < g.columns; ++c) {
            const PixelPoint d = bend(g.x0 + c * g.step, g.y0 + r * g.step);
            g.du.push_back(static_cast<float>(d.x));
            g.dv.push_back(static_cast<float>(d.y));
        }
    const auto response = [](double x, double y) {
        const double dx = (x - 104) / 104, dy = (y - 88) / 104;
        return 1 - 0.2 * (dx * dx + dy * dy);
    };
    UniformityGrid& u = t.uniformity;
    u.columns = 28, u.rows = 24, u.x0 = 0, u.y0 = 0, u.step = 8;
    for (int r = 0; r < u.rows; ++r)
        for (int c = 0; c < u.columns; ++c)
            u.values.push_back(static_cast<float>(response(u.x0 + c * u.step, u.y0 + r * u.step)));
    t.curve = gamma_points(256, 33, 2.2);

    const auto scene = [](double x, double y) { // smooth, with a bright blob
        const double blob = std::exp(-((x - 60) * (x - 60) + (y - 30) * (y - 30)) / 50);
        return 0.25 + 0.1 * std::sin(x / 9) + 0.1 * std::cos(y / 7) + 0.45 * blob;
    };
    std::vector<std::uint16_t> image(cw * ch);
    for (std::int32_t y = 0; y < ch; ++y)
        for (std::int32_t x = 0; x < cw; ++x)
            image[static_cast<std::size_t>(y * cw + x)] =
                static_cast<std::uint16_t>(std::lround(4095 * scene(x, y)));

    OpticalSettings s = settings_for(t);
    s.dither = Dither::both;
    OpticalStage stage(s, &t);
    std::vector<double> luminance(sw * sh, 0);
    constexpr int frames = 64;
    for (std::uint64_t frame = 0; frame < frames; ++frame) {
        const auto levels = render(stage, image, frame);
        for (std::size_t i = 0; i < luminance.size(); ++i)
            luminance[i] += std::pow(levels[i] / 255.0, 2.2) / frames; // the true screen, not the table's
    }
    CHECK(stage.clipped() == 0);
    double worst = 0, square = 0;
    std::size_t n = 0;
    for (std::int32_t y = 4; y < ch - 4; ++y) {
        for (std::int32_t x = 4; x < cw - 4; ++x) {
            double seen = 0;
            constexpr int sub = 6;
            for (int j = 0; j < sub; ++j)
                for (int i = 0; i < sub; ++i) {
                    const PixelPoint p =
                        t.map.inverse({x + (i + 0.5) / sub - 0.5, y + (j + 0.5) / sub - 0.5});
                    const auto px = static_cast<std::int32_t>(std::lround(p.x)),
                               py = static_cast<std::int32_t>(std::lround(p.y));
                    REQUIRE((px >= 0 && px < sw && py >= 0 && py < sh));
                    seen +=
                        luminance[static_cast<std::size_t>(py * sw + px)] * response(p.x, p.y) / (sub * sub);
                }
            const double error = seen / stage.peak() - scene(x, y);
            worst = std::max(worst, std::abs(error));
            square += error * error;
            ++n;
        }
    }
    INFO("worst " << worst << ", rms " << std::sqrt(square / static_cast<double>(n)));
    CHECK(worst < 0.012);
    CHECK(std::sqrt(square / static_cast<double>(n)) < 0.004);
}

TEST_CASE("A calibration that does not fit is refused") {
    CalibrationTable t = plain_table(64, 48, 100, 100);
    OpticalSettings s = settings_for(t);
    const auto refused = [&](const OpticalSettings& settings, const CalibrationTable& table) {
        try {
            const OpticalStage stage(settings, &table);
        } catch (const ConfigError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK(refused(s, t).empty());
    OpticalSettings other = s;
    other.screen_width = 65;
    CHECK_THAT(refused(other, t),
               ContainsSubstring("calibrated for a screen of 64x48 pixels, this one has 65x48"));
    other = s;
    other.sensor_height = 99;
    CHECK_THAT(refused(other, t), ContainsSubstring("camera of 100x100 pixels, the sensor has 100x99"));
    other = s;
    other.levels = 766;
    CHECK_THAT(refused(other, t), ContainsSubstring("256 drive levels, the format has 766"));
    other = s;
    other.dn_black = 5000;
    CHECK_THAT(refused(other, t), ContainsSubstring("not above black"));
    t.map.homography.h[2] = 1e4;
    CHECK_THAT(refused(s, t), ContainsSubstring("does not see the screen"));
}

TEST_CASE("A calibration file gives back what was put in") {
    const test::TempFolder folder;
    CalibrationTable t = plain_table(640, 480, 512, 400);
    t.levels = 766;
    t.map.homography = tilted;
    t.map.distortion = {3, 2, -1.5, 2.5, 400, {1, 2, 3, 4, 5, 6}, {6, 5, 4, 3, 2, 1}};
    t.curve = gamma_points(766, 17, 2.2);
    t.uniformity = {2, 3, 0, 0, 300, {1, 0.9F, 0.8F, 0.7F, 0.6F, 0.5F}};
    t.dead = {{5, 6}, {639, 479}};
    t.residual_px = 0.125;
    const auto file = folder.path() / "bench [1].fits"; // brackets mean something to cfitsio
    write_calibration(file, t);
    write_calibration(file, t); // replaces
    const CalibrationTable got = read_calibration(file);
    CHECK(got.screen_width == 640);
    CHECK(got.camera_height == 400);
    CHECK(got.levels == 766);
    CHECK(got.map.homography.h == t.map.homography.h);
    CHECK(got.map.distortion.du == t.map.distortion.du);
    CHECK(got.map.distortion.dv == t.map.distortion.dv);
    CHECK(got.map.distortion.step == 400);
    CHECK(got.map.distortion.x0 == -1.5);
    CHECK(got.uniformity.values == t.uniformity.values);
    CHECK(got.dead == t.dead);
    REQUIRE(got.curve.size() == t.curve.size());
    CHECK(got.curve[5].luminance == t.curve[5].luminance);
    CHECK(got.residual_px == 0.125);
    write_calibration(file, plain_table(10, 20, 30, 40));
    CHECK(read_calibration(file).curve.empty());

    const auto refused = [&](const CalibrationTable& table) {
        write_calibration(folder.path() / "bad.fits", table);
        try {
            (void)read_calibration(folder.path() / "bad.fits");
        } catch (const InputError& error) {
            return std::string(error.what());
        }
        return std::string();
    };
    CHECK(refused(t).empty());
    CalibrationTable bad = t;
    bad.dead.push_back({640, 0});
    CHECK_THAT(refused(bad), ContainsSubstring("DEAD names pixel 640,0"));
    bad = t;
    bad.curve[3].luminance = 0.9;
    CHECK_THAT(refused(bad), ContainsSubstring("luminance falls"));
    bad = t;
    bad.map.distortion.du[2] = std::nanf("");
    CHECK_THAT(refused(bad), ContainsSubstring("not finite"));
    bad = t;
    bad.map.homography.h[6] = -0.01;
    CHECK_THAT(refused(bad), ContainsSubstring("through infinity"));
    bad = t;
    bad.screen_width = 100000;
    CHECK_THAT(refused(bad), ContainsSubstring("SCREENW is 100000, allowed: 1..16384"));
    CHECK_THROWS_AS(read_calibration(folder.write("text.fits", "not a FITS file")), InputError);
    CHECK_THROWS_AS(read_calibration(folder.path() / "nothing.fits"), InputError);
    CHECK_THROWS_AS(write_calibration(folder.path() / "no" / "such.fits", t), OutputError);
}

TEST_CASE("Banding is what a flashing screen does to a rolling shutter") {
    // Count the flashes that fall into each row's exposure, and compare.
    for (const double refreshes : {1.5, 2.0, 3.25, 10.0, 7.9}) {
        const double hz = 60;
        const auto exposure_ns = static_cast<std::int64_t>(refreshes / hz * 1e9);
        double least = 1e9, most = 0, sum = 0;
        constexpr int rows = 20000;
        for (int row = 0; row < rows; ++row) {
            const double begin = (row + 0.37) * 1e-5 * hz, end = begin + refreshes; // in refreshes
            const double flashes = std::floor(end) - std::floor(begin);
            least = std::min(least, flashes);
            most = std::max(most, flashes);
            sum += flashes;
        }
        CHECK_THAT(banding(exposure_ns, hz), WithinAbs((most - least) / (sum / rows), 0.005));
    }
    CHECK(banding(0, 60) == 0);
}

TEST_CASE("Refresh warnings name what is wrong, and say nothing when all is well") {
    const ScreenTiming screen{60, 2 * ns_per_ms};
    const auto lines = [&](double exposure_ms, double readout_ms, double period_ms) {
        return explain_refresh(screen, {static_cast<std::int64_t>(exposure_ms * 1e6),
                                        static_cast<std::int64_t>(readout_ms * 1e6),
                                        static_cast<std::int64_t>(period_ms * 1e6)});
    };
    CHECK(lines(100.0 / 3, 20, 100).empty());
    REQUIRE(lines(5, 20, 100).size() == 1);
    CHECK_THAT(lines(5, 20, 100)[0],
               ContainsSubstring("exposure of 5.000 ms is shorter than the screen's refresh of 16.667 ms"));
    REQUIRE(lines(25, 0, 100).size() == 1);
    CHECK_THAT(lines(25, 0, 100)[0],
               ContainsSubstring("1.50 refreshes of 16.667 ms: flicker between frames of up to 66.7 %"));
    CHECK_THAT(lines(25, 5, 100)[0], ContainsSubstring("bands between rows"));
    REQUIRE(lines(100.0 / 6, 5, 10).size() == 2);
    CHECK_THAT(lines(100.0 / 6, 5, 10)[0], ContainsSubstring("not every frame is shown"));
    REQUIRE(lines(100.0 / 3, 60, 100).size() == 1);
    CHECK_THAT(lines(100.0 / 3, 60, 100)[0], ContainsSubstring("the last rows see two frames"));
    CHECK(explain_refresh({0, 0}, {1, 1, 1}).empty());
}

} // namespace stimulator_optical_test
