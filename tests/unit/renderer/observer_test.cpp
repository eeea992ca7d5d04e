// SPDX-License-Identifier: Apache-2.0
// A moving observer, light that takes its time, filters and stray light.
#include "core/error.hpp"
#include "images/writers/exr.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/world/row_state.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fitsio.h>

#include <array>
#include <cmath>
#include <string>

namespace observer_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double c = renderer::light_speed_m_s;

/// Angle between unit vectors, exact for small ones.
double angle(Vec3 a, Vec3 b) {
    return std::atan2(length(cross(a, b)), dot(a, b));
}

std::string write_map(const TempFolder& folder, std::int32_t size, long planes, double value) {
    const std::string file = (folder.path() / ("map" + std::to_string(planes) + ".fits")).string();
    fitsfile* fits = nullptr;
    int status = 0;
    long axes[3] = {size, size, planes};
    std::vector<double> values(static_cast<std::size_t>(size) * static_cast<std::size_t>(size) *
                               static_cast<std::size_t>(planes));
    for (std::size_t i = 0; i < values.size(); ++i)
        values[i] = value * static_cast<double>(i % 1000);
    fits_create_diskfile(&fits, file.c_str(), &status);
    fits_create_img(fits, DOUBLE_IMG, planes > 1 ? 3 : 2, axes, &status);
    fits_write_img(fits, TDOUBLE, 1, static_cast<LONGLONG>(values.size()), values.data(), &status);
    fits_close_file(fits, &status);
    REQUIRE(status == 0);
    return file;
}

} // namespace

TEST_CASE("Aberration is that of special relativity, to 1e-6 px and at any speed") {
    for (const double beta : {1e-5, 9.9e-5, 0.1, 0.9})
        for (const double t : {0.0, 0.3, 1.2, 2.0, 3.1}) {
            const Vec3 motion = normalized(Vec3{0.3, -0.5, 0.8});
            const Vec3 side = normalized(cross(motion, Vec3{1, 0, 0}));
            const Vec3 seen = renderer::aberrate(motion * std::cos(t) + side * std::sin(t), beta * motion);
            // tan (t'/2) = sqrt((1 - beta) / (1 + beta)) tan (t/2)
            const double expected = 2 * std::atan(std::sqrt((1 - beta) / (1 + beta)) * std::tan(t / 2));
            CHECK_THAT(angle(seen, motion), WithinAbs(expected, 1e-14));
            CHECK_THAT(angle(renderer::aberrate(seen, -beta * motion), motion), WithinAbs(t, 1e-13));
        }
    // Through the lens: 30 km/s across the line of sight, pixels of 10 urad.
    scene::Camera camera;
    camera.focal_length_m = 1;
    camera.pixel_pitch_m = 10e-6;
    const auto lens = renderer::make_projection(camera);
    const double beta = 3e4 / c;
    const renderer::MovingLens moving(*lens, {beta, 0, 0});
    const auto at = moving.project({0, 0, 1});
    REQUIRE(at);
    // At right angles to the motion: sin of the shift is beta.
    CHECK_THAT(at->x, WithinAbs(511.5 + std::tan(std::asin(beta)) / 10e-6, 1e-6));
    CHECK_THAT(at->y, WithinAbs(511.5, 1e-6));
    renderer::Doubles x;
    renderer::Doubles y;
    for (int i = 0; i < renderer::packet_size; ++i) {
        x[i] = 60.0 * i;
        y[i] = 1000 - 37.0 * i;
    }
    renderer::Vec3s rays;
    renderer::Doubles weight;
    moving.rays(x, y, rays, weight);
    for (int i = 0; i < renderer::packet_size; ++i) {
        const auto back = moving.project(rays.lane(i));
        REQUIRE(back);
        CHECK_THAT(back->x, WithinAbs(x[i], 1e-6));
        CHECK_THAT(back->y, WithinAbs(y[i], 1e-6));
    }
}

TEST_CASE("Stars and bodies are moved alike in the picture of a moving camera") {
    scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0, 4, 64);
    const Pose camera = s.camera.motion.samples[0].pose;
    const Vec3 right = rotate(camera.orientation, {1, 0, 0});
    const double pixel_rad = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const auto centre = [](const Image& image) {
        double sum = 0;
        double across = 0;
        for (int y = 0; y < image.height; ++y)
            for (int x = 0; x < image.width; ++x) {
                sum += static_cast<double>(image.at(x, y));
                across += x * static_cast<double>(image.at(x, y));
            }
        return across / sum;
    };
    const double speed = 10 * pixel_rad * c; // ten pixels: 0.1 c, but a number to see
    const double before = centre(render(renderer::Renderer(s, {64, 2, 1})));
    s.aberration = true;
    // By the trajectory itself, and by a velocity of its own.
    const double expected = std::tan(std::asin(speed / c)) / pixel_rad;
    s.camera.velocity_m_s = speed * right;
    CHECK_THAT(centre(render(renderer::Renderer(s, {64, 2, 1}))) - before, WithinAbs(expected, 0.02));
    s.camera.velocity_m_s = {};
    s.camera.motion.samples = {{-1, camera}, {1, camera}};
    s.camera.motion.samples[0].pose.position_m = camera.position_m - speed * right;
    s.camera.motion.samples[1].pose.position_m = camera.position_m + speed * right;
    CHECK_THAT(centre(render(renderer::Renderer(s, {64, 2, 1}))) - before, WithinAbs(expected, 0.02));
    const Vec3 ahead = rotate(camera.orientation, {0, 0, 1});
    s.bodies.clear();
    s.stars.push_back({std::atan2(ahead.y, ahead.x), std::asin(ahead.z), 0, 0.5});
    CHECK_THAT(centre(render(renderer::Renderer(s, {}))), WithinAbs(31.5 + expected, 1e-3));
}

TEST_CASE("Bodies are seen where they were when the light left them, to 1e-6 px") {
    scene::Scene s;
    s.light_time = true;
    // One flies across at 30 km/s two million km away, the other recedes; the camera moves too.
    const Vec3 start[2] = {{1e8, 2e9, 3e7}, {-5e7, 1.5e9, 0}};
    const Vec3 velocity[2] = {{3e4, 0, -1e4}, {1e3, 5e4, 0}};
    for (int k = 0; k < 2; ++k) {
        scene::Body body{"body" + std::to_string(k),
                         renderer::EllipsoidParameters{{1e6, 1e6, 1e6}},
                         renderer::LambertParameters{0.5},
                         {}};
        body.motion.samples = {{-1e4, {start[k] - 1e4 * velocity[k], {1, 0, 0, 0}}},
                               {1e4, {start[k] + 1e4 * velocity[k], {1, 0, 0, 0}}}};
        s.bodies.push_back(body);
    }
    const Vec3 camera_velocity{-2e4, 0, 1e3};
    const Quat look = look_along({0, 1, 0}, {0, 0, 1});
    s.camera.motion.samples = {{-1e4, {-1e4 * camera_velocity, look}}, {1e4, {1e4 * camera_velocity, look}}};
    const renderer::Renderer r(s, {});
    for (const double t : {-100.0, 0.0, 2345.6}) {
        GroundTruth truth{};
        r.fill_truth({static_cast<std::int64_t>(std::llround(t * 1e9))}, truth);
        for (std::uint32_t k = 0; k < 2; ++k) {
            // |p + v (t - tau) - camera(t)| = c tau, a quadratic in tau.
            const Vec3 d = start[k] + t * velocity[k] - t * camera_velocity;
            const double a = c * c - dot(velocity[k], velocity[k]);
            const double b = dot(d, velocity[k]);
            const double tau = (-b + std::sqrt(b * b + a * dot(d, d))) / a;
            const Vec3 expected = d - tau * velocity[k];
            const Vec3 seen = truth.bodies[k].pose.position_m - truth.camera.position_m;
            // Pixels of 10 urad.
            CHECK(angle(normalized(seen), normalized(expected)) / 10e-6 < 1e-6);
            CHECK(angle(normalized(seen), normalized(d)) / 10e-6 > 0.2); // it does matter
        }
    }
    s.light_time = false;
    GroundTruth truth{};
    renderer::Renderer(s, {}).fill_truth({0}, truth);
    CHECK(length(truth.bodies[0].pose.position_m - start[0]) < 1e-3);
}

TEST_CASE("A filter weighs the light of a band by its curve") {
    const SpectralBand open{400e-9, 900e-9};
    SpectralBand half = open;
    half.transmission = {{500e-9, 0.5}};
    CHECK_THAT(renderer::sun_irradiance_w_m2(half), WithinRel(renderer::sun_irradiance_w_m2(open) / 2, 1e-9));
    // A narrow window is the narrow band.
    SpectralBand window = open;
    window.transmission = {{599.99e-9, 0}, {600e-9, 1}, {650e-9, 1}, {650.01e-9, 0}};
    const SpectralBand narrow{600e-9, 650e-9};
    CHECK_THAT(renderer::sun_irradiance_w_m2(window), WithinRel(renderer::sun_irradiance_w_m2(narrow), 2e-3));
    CHECK_THAT(renderer::star_irradiance_w_m2({0, 0, 1, 0.6}, window),
               WithinRel(renderer::star_irradiance_w_m2({0, 0, 1, 0.6}, narrow), 5e-3));
    // A ramp over a flat spectrum of a star: between its ends.
    SpectralBand ramp{540e-9, 550e-9};
    ramp.transmission = {{540e-9, 0.2}, {550e-9, 0.8}};
    const SpectralBand flat{540e-9, 550e-9};
    CHECK_THAT(renderer::star_irradiance_w_m2({0, 0, 1, 0.6}, ramp),
               WithinRel(renderer::star_irradiance_w_m2({0, 0, 1, 0.6}, flat) / 2, 2e-3));
    // And in a picture.
    scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0.5, 10, 32);
    const double before = render(renderer::Renderer(s, {})).sum();
    s.bands[0] = half;
    CHECK_THAT(render(renderer::Renderer(s, {})).sum(), WithinRel(before / 2, 1e-6));
    s.bands[0].transmission = {{500e-9, 0.5}, {450e-9, 0.5}};
    CHECK_THROWS_AS(renderer::Renderer(s, {}), ConfigError);
}

TEST_CASE("Stray light is added as its map says, in windows too, and may follow the Sun") {
    const TempFolder folder;
    scene::Scene s;
    s.camera.width = s.camera.height = 40;
    s.sun.position_m = {2 * astronomical_unit_m, 0, 0};
    s.bands = {{400e-9, 500e-9}, {500e-9, 600e-9}};
    s.stray_light = {{write_map(folder, 40, 1, 1e-9), 2.0, false},
                     {write_map(folder, 40, 2, 1e-9), 1.0, true}};
    const renderer::Renderer r(s, {});
    const Region window{7, 5, 20, 11};
    const std::vector<float> frame = render_window(r, window, 4);
    for (std::size_t band = 0; band < 2; ++band)
        for (int y = 0; y < window.height; ++y)
            for (int x = 0; x < window.width; ++x) {
                const std::size_t at = static_cast<std::size_t>(y + 5) * 40 + static_cast<std::size_t>(x + 7);
                const double expected = 1e-9 * (2.0 * static_cast<double>(at % 1000) +
                                                0.25 * static_cast<double>((at + band * 1600) % 1000));
                const auto i = band * 220 + static_cast<std::size_t>(y) * 20 + static_cast<std::size_t>(x);
                REQUIRE_THAT(static_cast<double>(frame[i]), WithinRel(expected, 1e-6));
            }
    s.camera.width = 41;
    CHECK_THROWS_AS(renderer::Renderer(s, {}), ConfigError);
}

TEST_CASE("Stray light comes from OpenEXR as well") {
    const TempFolder folder;
    scene::Scene s;
    s.camera.width = 40;
    s.camera.height = 30;
    s.bands = {{400e-9, 500e-9}, {1000e-9, 1100e-9}, {500e-9, 600e-9}};
    constexpr std::size_t pixels = 40 * 30;
    const auto plane = [](float value) {
        std::vector<float> values(pixels);
        for (std::size_t i = 0; i < pixels; ++i)
            values[i] = value * static_cast<float>(i);
        return values;
    };
    const std::vector<float> one = plane(1), two = plane(2), three = plane(3);
    const auto stray = [&](const std::string& name) {
        s.stray_light = {{(folder.path() / name).string(), 1e-9, false}};
        return render_window(renderer::Renderer(s, {}), {0, 0, 40, 30});
    };
    const auto check = [&](const std::vector<float>& frame, std::array<double, 3> wanted) {
        for (std::size_t band = 0; band < 3; ++band)
            for (std::size_t i = 1; i < pixels; i += 7)
                REQUIRE_THAT(static_cast<double>(frame[band * pixels + i]),
                             WithinRel(1e-9 * wanted[band] * static_cast<double>(i), 1e-6));
    };
    images::write_exr(folder.path() / "grey.exr", 40, 30, {{"Y", "", two}}, {});
    check(stray("grey.exr"), {2, 2, 2});
    // Channels as `obscura render` names them; the order in the file is the alphabet's.
    images::write_exr(folder.path() / "bands.exr", 40, 30,
                      {{"irradiance.400-500nm", "", one},
                       {"irradiance.1000-1100nm", "", two},
                       {"irradiance.500-600nm", "", three}},
                      {});
    check(stray("bands.exr"), {1, 2, 3});
    // Red, green and blue at 650, 550 and 450 nm.
    images::write_exr(folder.path() / "rgb.exr", 40, 30, {{"R", "", one}, {"G", "", two}, {"B", "", three}},
                      {});
    check(stray("rgb.exr"), {3, 1, 2});
    images::write_exr(folder.path() / "small.exr", 30, 30, {{"Y", "", std::vector<float>(900, 1)}}, {});
    CHECK_THROWS_AS(stray("small.exr"), ConfigError);
    std::vector<float> negative = one;
    negative[7] = -1;
    images::write_exr(folder.path() / "negative.exr", 40, 30, {{"Y", "", negative}}, {});
    CHECK_THROWS_AS(stray("negative.exr"), InputError);
    (void)folder.write("text.exr", "no picture");
    CHECK_THROWS_AS(stray("text.exr"), InputError);
}

} // namespace observer_test
