// SPDX-License-Identifier: Apache-2.0
// Wings of the PSF of resolved bodies, against the convolution in closed form; determinism, motion, flux.
#include "psf_planes.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace psf_wings_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double px_rad = 10e-6 / 0.8;
constexpr double distance_m = 1e6;

/// An f/20 telescope with pixels of 10 um: 550 nm times the f-number is 1.1 px.
scene::Scene telescope(std::int32_t size, double wings_px) {
    scene::Scene s;
    s.bands = {{549.9e-9, 550.1e-9}};
    s.sun.irradiance_scale = 0;
    s.camera.width = s.camera.height = size;
    s.camera.focal_length_m = 0.8;
    s.camera.aperture_m = 0.04;
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.psf.model = scene::PointSpread::Model::airy;
    s.camera.psf.wings_px = wings_px;
    s.camera.motion.samples[0].pose.orientation = look_along({1, 0, 0}, {0, 0, 1});
    return s;
}

/// Place of what is seen (x, y) px from the middle of the sensor.
Vec3 place_of(const scene::Scene& s, double x, double y) {
    return rotate(s.camera.motion.samples[0].pose.orientation,
                  {x * px_rad * distance_m, y * px_rad * distance_m, distance_m});
}

/// A ball of uniform radiance, (x, y) px from the middle of the sensor.
void add_lamp(scene::Scene& s, double x, double y, double radius_px, std::vector<double> radiance = {1}) {
    const double radius_m = radius_px * px_rad * distance_m;
    scene::Body body{"lamp " + std::to_string(s.bodies.size()),
                     renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}},
                     renderer::LambertParameters{0},
                     {}};
    body.emission_w_m2_sr = std::move(radiance);
    body.motion.samples[0].pose.position_m = place_of(s, x, y);
    s.bodies.push_back(body);
}

/// Light per px^2 of the Airy pattern by radius, at steps of 1/64 px; `airy_px` = wavelength times f-number.
std::vector<double> airy_pattern(double airy_px, double to_px) {
    std::vector<double> pattern;
    for (double r = 1.0 / 128; r < to_px; r += 1.0 / 64) {
        const double v = pi * r / airy_px;
        const double j = 2 * std::cyl_bessel_j(1, v) / v;
        pattern.push_back(pi / 4 / (airy_px * airy_px) * j * j);
    }
    return pattern;
}

/// Irradiance of a pixel at a distance from the centre of a disc of radiance 1: for every ring of the pattern
/// the part of its circumference that lies in the disc.
double disc(const std::vector<double>& pattern, double radius_px, double distance_px) {
    double sum = 0;
    double r = 1.0 / 128;
    for (const double light : pattern) {
        double arc = 0;
        if (r + distance_px <= radius_px)
            arc = pi;
        else if (r < radius_px + distance_px && distance_px < radius_px + r)
            arc = std::acos(std::clamp((r * r + distance_px * distance_px - radius_px * radius_px) /
                                           (2 * r * distance_px),
                                       -1.0, 1.0));
        sum += arc * 2 * r * light / 64;
        r += 1.0 / 64;
    }
    return sum * px_rad * px_rad;
}

/// Relative errors of pixels against a disc.
struct Errors {
    double rms = 0, mean = 0;
    std::size_t pixels = 0;
};

/// A lamp, and where it is.
struct Lamp {
    double x, y, radius_px;
};

/// Errors of the pixels whose distance from the limb (negative: inside), in pitches of the columns, is in
/// [from, to]. `aspect`: pitch of the rows over that.
Errors errors_of(std::span<const float> image, std::int32_t size, const Lamp& lamp,
                 const std::vector<double>& pattern, double from, double to, double aspect = 1) {
    // Means over a pixel, at steps of a quarter of one.
    std::vector<double> expected;
    for (double d = from - 0.25; d < to + 0.5; d += 0.25) {
        double mean = 0;
        for (int k = 0; k < 4; ++k)
            mean += aspect * disc(pattern, lamp.radius_px, std::abs(lamp.radius_px + d + (k - 1.5) / 4)) / 4;
        expected.push_back(mean);
    }
    Errors e;
    for (std::int32_t j = 0; j < size; ++j)
        for (std::int32_t i = 0; i < size; ++i) {
            const double d =
                std::hypot(i - (size - 1) / 2.0 - lamp.x, aspect * (j - (size - 1) / 2.0) - lamp.y) -
                lamp.radius_px;
            if (d < from || d > to) continue;
            const double at = (d - from + 0.25) * 4;
            const auto k = static_cast<std::size_t>(at);
            const double want = expected[k] + (expected[k + 1] - expected[k]) * (at - static_cast<double>(k));
            const double error =
                static_cast<double>(image[static_cast<std::size_t>(j * size + i)]) / want - 1;
            e.rms += error * error;
            e.mean += error;
            ++e.pixels;
        }
    e.rms = std::sqrt(e.rms / static_cast<double>(e.pixels));
    e.mean /= static_cast<double>(e.pixels);
    return e;
}

/// The rows of the whole sensor, `group` at a time, each with its own time.
std::vector<float> render_rows(const renderer::Renderer& r, std::span<const RowTime> times,
                               std::int32_t group, std::uint64_t frame_id = 1) {
    const std::int32_t size = r.scene().camera.width;
    const auto width = static_cast<std::size_t>(size);
    std::vector<float> image(r.band_count() * width * width);
    std::vector<float> part;
    for (std::int32_t first = 0; first < size; first += group) {
        renderer::RenderRequest request;
        request.window = {0, 0, size, size};
        request.first_row = first;
        request.rows = std::min(group, size - first);
        request.row_times =
            times.subspan(static_cast<std::size_t>(first), static_cast<std::size_t>(request.rows));
        request.frame_id = frame_id;
        const std::size_t values = width * static_cast<std::size_t>(request.rows);
        part.resize(r.band_count() * values);
        r.render(request, part);
        for (std::size_t b = 0; b < r.band_count(); ++b)
            std::copy_n(part.begin() + static_cast<std::ptrdiff_t>(b * values), values,
                        image.begin() + static_cast<std::ptrdiff_t>(
                                            (b * width + static_cast<std::size_t>(first)) * width));
    }
    return image;
}

/// Each row 30 us after the one above it, exposed for `exposure_ns`.
std::vector<RowTime> rolling(std::int32_t rows, std::int64_t exposure_ns) {
    std::vector<RowTime> times;
    for (std::int32_t y = 0; y < rows; ++y)
        times.push_back({Time{5'000'000'000 + y * 30'000}, Time{5'000'000'000 + y * 30'000 + exposure_ns}});
    return times;
}

/// The lamp moves by `px` a second to the right.
void move(scene::Scene& s, std::size_t body, double px) {
    auto& samples = s.bodies[body].motion.samples;
    samples.push_back(samples[0]);
    samples[0].time_s = 0;
    samples[1].time_s = 10;
    const Vec3 step = place_of(s, 10 * px, 0) - place_of(s, 0, 0);
    samples[1].pose.position_m = samples[0].pose.position_m + step;
}

} // namespace

TEST_CASE("The wings of a disc are its convolution: 1e-4 inside, 1 % of the glow outside") {
    const std::vector<double> pattern = airy_pattern(1.1, 200);
    for (const Lamp& lamp : {Lamp{10.3, -5.6, 12}, Lamp{10.3, -5.6, 40}, Lamp{10.3, -5.6, 100}}) {
        INFO("radius " << lamp.radius_px << " px");
        scene::Scene s = telescope(320, 200);
        add_lamp(s, lamp.x, lamp.y, lamp.radius_px);
        const Image image = render(renderer::Renderer(s, {4, 2, 1}));
        // Within the core's radius of the limb, pixels are as noisy as their samples.
        if (lamp.radius_px > 17) {
            const Errors inside = errors_of(image.values, 320, lamp, pattern, -lamp.radius_px, -17);
            CHECK(inside.rms < 1e-4);
        }
        for (const auto& [from, to] : {std::pair{17.0, 20.0}, {20.0, 30.0}, {30.0, 60.0}, {60.0, 120.0}}) {
            INFO("from " << from << " to " << to << " px off the limb");
            const Errors glow = errors_of(image.values, 320, lamp, pattern, from, to);
            CHECK(glow.pixels > 100);
            CHECK(glow.rms < 1e-2);
        }
    }
}

TEST_CASE("A body outside the field leaves the glow of its convolution") {
    const std::vector<double> pattern = airy_pattern(1.1, 400);
    for (const Lamp& lamp : {Lamp{90, 30, 5}, Lamp{-130, -120, 30}, Lamp{0, 300, 200}}) {
        INFO("radius " << lamp.radius_px << " px");
        scene::Scene s = telescope(128, 400);
        add_lamp(s, lamp.x, lamp.y, lamp.radius_px);
        const Image image = render(renderer::Renderer(s, {4, 2, 1}));
        const Errors glow = errors_of(image.values, 128, lamp, pattern, 17, 350);
        CHECK(glow.pixels > 15000);
        CHECK(glow.rms < 1e-2);
    }
}

TEST_CASE("The wings of rectangular pixels are those of their places on the focal plane") {
    const std::vector<double> pattern = airy_pattern(1.1, 200);
    for (const double aspect : {1.7, 0.6}) {
        INFO("pitch of the rows " << aspect << " times that of the columns");
        const auto scene_of = [&](const Lamp& lamp) {
            scene::Scene s = telescope(256, 200);
            s.camera.pixel_pitch_y_m = aspect * s.camera.pixel_pitch_m;
            add_lamp(s, lamp.x, lamp.y, lamp.radius_px);
            return s;
        };
        // A body in the field, a small one, and one outside; places in pitches of the columns.
        for (const Lamp& lamp : {Lamp{10.3, -5.6, 40}, Lamp{-20.7, 8.4, 8}, Lamp{-70, 150 * aspect, 15}}) {
            INFO("radius " << lamp.radius_px);
            const Image image = render(renderer::Renderer(scene_of(lamp), {4, 2, 1}));
            for (const auto& [from, to] : {std::pair{18.0, 30.0}, {30.0, 60.0}, {60.0, 120.0}}) {
                INFO("from " << from << " to " << to << " off the limb");
                const Errors glow = errors_of(image.values, 256, lamp, pattern, from, to, aspect);
                CHECK(glow.pixels > 100);
                CHECK(glow.rms < 1e-2);
            }
            if (lamp.radius_px == 40) {
                const Errors inside = errors_of(image.values, 256, lamp, pattern, -40, -18, aspect);
                CHECK(inside.rms < 1e-4);
            }
        }
        // Splatted, by one point or many.
        const Lamp small{3.3, -8.1, 1};
        const Image image = render(renderer::Renderer(scene_of(small), {4, 2, 1}));
        CHECK(std::abs(errors_of(image.values, 256, small, pattern, 20, 80, aspect).mean) < 5e-3);
    }
}

TEST_CASE("Each place of the field has wings of its own") {
    // Two profiles, at two columns; between these they blend. Bodies are so large that their parts differ.
    constexpr int side = 257;
    constexpr std::int32_t size = 256;
    constexpr double wings_px = 120;
    const double columns[2] = {60, 200};
    std::vector<Plane> planes;
    std::vector<double> profile[2]; // light per px^2 by the squared distance
    for (const int k : {0, 1}) {
        const auto at = [&](double r2) { return std::pow(1 + r2 / 4, k == 0 ? -1.25 : -1.6); };
        Plane plane{side, {}, 1, columns[k], 127.5, 0};
        double sum = 0;
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i) {
                plane.values.push_back(at((i - 128) * (i - 128) + (j - 128) * (j - 128)));
                sum += plane.values.back();
            }
        planes.push_back(plane);
        for (int r2 = 0; r2 <= wings_px * wings_px; ++r2)
            profile[k].push_back(at(r2) / sum);
    }
    const TempFolder folder;
    scene::Scene s = telescope(size, wings_px);
    s.camera.psf.model = scene::PointSpread::Model::table;
    s.camera.psf.file = write_fits(folder, "places.fits", planes);
    const Lamp lamps[] = {{-79.2, -3.4, 30}, {84.6, 20.5, 16}, {70, 108, 13}};
    for (const Lamp& lamp : lamps)
        add_lamp(s, lamp.x, lamp.y, lamp.radius_px);
    const Image image = render(renderer::Renderer(s, {4, 2, 1}));
    // Points of the bodies, their light, and the share of the second profile there.
    struct Point {
        double x, y, light, second;
    };
    std::vector<Point> points;
    for (const Lamp& lamp : lamps) {
        const std::size_t first = points.size();
        for (double y = 0.25 - lamp.radius_px; y < lamp.radius_px; y += 0.5)
            for (double x = 0.25 - lamp.radius_px; x < lamp.radius_px; x += 0.5)
                if (std::hypot(x, y) < lamp.radius_px) {
                    const double column = lamp.x + x + (size - 1) / 2.0;
                    points.push_back(
                        {column, lamp.y + y + (size - 1) / 2.0, 0,
                         std::clamp((column - columns[0]) / (columns[1] - columns[0]), 0.0, 1.0)});
                }
        for (std::size_t i = first; i < points.size(); ++i)
            points[i].light = pi * lamp.radius_px * lamp.radius_px * px_rad * px_rad /
                              static_cast<double>(points.size() - first);
    }
    double square[3] = {};
    int count[3] = {};
    for (std::int32_t j = 0; j < size; j += 3)
        for (std::int32_t i = 0; i < size; i += 3) {
            // Off all limbs by more than the core, in the glow of the first two bodies or of both.
            bool clear = true;
            double nearest[3] = {};
            for (const int k : {0, 1, 2}) {
                nearest[k] =
                    std::hypot(i - (size - 1) / 2.0 - lamps[k].x, j - (size - 1) / 2.0 - lamps[k].y) -
                    lamps[k].radius_px;
                clear = clear && nearest[k] > 17;
            }
            if (!clear || std::min(nearest[0], nearest[1]) > 75) continue;
            double want = 0;
            for (const Point& p : points) {
                const double r2 = (i - p.x) * (i - p.x) + (j - p.y) * (j - p.y);
                if (r2 >= wings_px * wings_px) continue;
                const auto at = static_cast<std::size_t>(r2);
                const double t = r2 - static_cast<double>(at);
                const auto glow = [&](int k) {
                    const std::size_t next = std::min(at + 1, profile[k].size() - 1);
                    return profile[k][at] * (1 - t) + profile[k][next] * t;
                };
                want += p.light * ((1 - p.second) * glow(0) + p.second * glow(1));
            }
            const double error = static_cast<double>(image.at(i, j)) / want - 1;
            const int k = nearest[0] < 75 ? nearest[1] < 75 ? 2 : 0 : 1;
            square[k] += error * error;
            ++count[k];
        }
    for (const int k : {0, 1, 2}) {
        INFO("glow of " << (k == 0 ? "the first body" : k == 1 ? "the second" : "both"));
        CHECK(count[k] > 100);
        CHECK(std::sqrt(square[k] / count[k]) < 1e-2);
    }
}

TEST_CASE("Each band has wings of its own") {
    const Lamp lamp{-7.2, 11.9, 50};
    scene::Scene s = telescope(256, 150);
    s.bands = {{449.9e-9, 450.1e-9}, {899.8e-9, 900.2e-9}};
    add_lamp(s, lamp.x, lamp.y, lamp.radius_px, {1, 2});
    const std::vector<float> image = render_window(renderer::Renderer(s, {4, 2, 1}), {0, 0, 256, 256});
    for (const std::size_t band : {0u, 1u}) {
        INFO("band " << band);
        std::vector<double> pattern = airy_pattern(band == 0 ? 0.9 : 1.8, 150);
        for (double& p : pattern)
            p *= band == 0 ? 1 : 2;
        const Errors glow =
            errors_of(std::span(image).subspan(band * 256 * 256, 256 * 256), 256, lamp, pattern, 17, 80);
        CHECK(glow.rms < 1e-2);
    }
}

TEST_CASE("Light is kept: a lamp's light is all in core and wings") {
    // Beyond the wings' own radius there is none.
    scene::Scene s = telescope(200, 60);
    add_lamp(s, 0.4, 0.2, 20);
    double sum = 0;
    const std::vector<double> pattern = airy_pattern(1.1, 60);
    for (std::size_t k = 0; k < pattern.size(); ++k)
        sum += pattern[k] * 2 * pi * (static_cast<double>(k) + 0.5) / 64 / 64;
    CHECK_THAT(render(renderer::Renderer(s, {256, 2, 1})).sum() / (pi * 400 * px_rad * px_rad),
               WithinRel(sum, 2e-4));
}

TEST_CASE("Wings are the same whether they are splatted or convolved") {
    double glow[2];
    for (const int i : {0, 1}) {
        const double radius_px = i == 0 ? 2.95 : 3.05; // bodies below 3 px are splatted
        scene::Scene s = telescope(160, 120);
        add_lamp(s, 3.3, -8.1, radius_px);
        const Image image = render(renderer::Renderer(s, {4, 2, 1}));
        double sum = 0;
        for (std::int32_t y = 0; y < 160; ++y)
            for (std::int32_t x = 0; x < 160; ++x)
                if (const double r = std::hypot(x - 82.8, y - 71.4); r > 20 && r < 60)
                    sum += static_cast<double>(image.at(x, y));
        glow[i] = sum / (radius_px * radius_px);
    }
    CHECK_THAT(glow[1], WithinRel(glow[0], 5e-3));
}

TEST_CASE("Threads, row blocks and windows change no byte of the wings") {
    scene::Scene s = telescope(150, 100);
    s.bands.push_back({700e-9, 800e-9});
    add_lamp(s, 10, 20, 60, {1, 0.5});
    add_lamp(s, -40, -90, 8, {3, 5});
    add_lamp(s, 60, -30, 1, {1, 1});
    move(s, 0, 300);
    move(s, 1, -200);
    for (const std::int64_t exposure_ns : {0, 4'000'000}) {
        INFO("exposure " << exposure_ns << " ns");
        const std::vector<RowTime> times = rolling(150, exposure_ns);
        const std::vector<float> one = render_rows(renderer::Renderer(s, {2, 1, 7}), times, 150);
        const renderer::Renderer two(s, {2, 2, 7});
        CHECK(one == render_rows(two, times, 7));
        CHECK(one == render_rows(two, times, 64));
        // The same renderer, after other times.
        (void)render_rows(two, rolling(150, 1'000'000), 150);
        CHECK(one == render_rows(two, times, 1));
    }
    const renderer::Renderer r(s, {2, 2, 7});
    const std::vector<float> whole = render_window(r, {0, 0, 150, 150});
    const renderer::Renderer other(s, {2, 2, 7});
    const Region window{37, 41, 61, 55};
    const std::vector<float> part = render_window(other, window, 13);
    std::size_t differing = 0;
    for (std::size_t b = 0; b < 2; ++b)
        for (std::int32_t y = 0; y < window.height; ++y)
            for (std::int32_t x = 0; x < window.width; ++x)
                differing +=
                    whole[(b * 150 + static_cast<std::size_t>(window.y + y)) * 150 +
                          static_cast<std::size_t>(window.x + x)] !=
                            part[(b * 55 + static_cast<std::size_t>(y)) * 61 + static_cast<std::size_t>(x)]
                        ? 1
                        : 0;
    CHECK(differing == 0);
}

TEST_CASE("With a rolling shutter each row has the wings of its own time") {
    // The lamp crosses 15 px while the rows are read out.
    scene::Scene s = telescope(128, 200);
    add_lamp(s, -40 - 5 * 3900, 0, 15);
    move(s, 0, 3900);
    const std::vector<RowTime> times = rolling(128, 0);
    const renderer::Renderer r(s, {4, 2, 1});
    const std::vector<float> image = render_rows(r, times, 16);
    for (const std::int32_t y : {4, 40, 90, 125}) {
        const double x = -40 + 3900 * 30e-6 * y;
        scene::Scene still = telescope(128, 200);
        add_lamp(still, x, 0, 15);
        const Image want = render(renderer::Renderer(still, {4, 2, 1}));
        double square = 0;
        int count = 0;
        for (std::int32_t i = 0; i < 128; ++i) {
            if (std::hypot(i - 63.5 - x, y - 63.5) < 15 + 17) continue;
            const double got = static_cast<double>(image[static_cast<std::size_t>(y * 128 + i)]);
            const double error = got / static_cast<double>(want.at(i, y)) - 1;
            square += error * error;
            ++count;
        }
        INFO("row " << y);
        CHECK(std::sqrt(square / count) < 0.02);
    }
}

TEST_CASE("The wings of what moves while a row is exposed are the mean over the exposure") {
    scene::Scene s = telescope(128, 100);
    add_lamp(s, -20 - 5 * 1000, 0, 10);
    move(s, 0, 1000);
    const std::int64_t exposure_ns = 40'000'000; // 40 px
    const std::vector<RowTime> times(128, RowTime{Time{5'000'000'000}, Time{5'000'000'000 + exposure_ns}});
    const std::vector<float> image = render_rows(renderer::Renderer(s, {4, 2, 1}), times, 128);
    std::vector<double> want(128 * 128, 0.0);
    constexpr int steps = 20;
    for (int k = 0; k < steps; ++k) {
        scene::Scene still = telescope(128, 100);
        add_lamp(still, -20 + 40 * (k + 0.5) / steps, 0, 10);
        const Image at = render(renderer::Renderer(still, {4, 2, 1}));
        for (std::size_t i = 0; i < want.size(); ++i)
            want[i] += static_cast<double>(at.values[i]) / steps;
    }
    double square = 0;
    int count = 0;
    for (std::size_t i = 0; i < want.size(); ++i) {
        const double x = static_cast<double>(i % 128) - 63.5;
        const double y = static_cast<double>(i / 128) - 63.5;
        if (std::hypot(x - std::clamp(x, -20.0, 20.0), y) < 10 + 18) continue;
        const double error = static_cast<double>(image[i]) / want[i] - 1;
        square += error * error;
        ++count;
    }
    CHECK(count > 5000);
    CHECK(std::sqrt(square / count) < 0.02);
}

} // namespace psf_wings_test
