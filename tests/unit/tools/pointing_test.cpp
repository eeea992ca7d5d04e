// SPDX-License-Identifier: Apache-2.0
// Pointing fits against cameras turned by known angles, made from directions on the sky, and I/F against a
// Lambert disc.
#include "core/error.hpp"
#include "tests/support/catch.hpp"
#include "tools/compare/pointing.hpp"
#include "tools/compare/registration.hpp"

#include <cmath>
#include <numbers>
#include <random>

namespace pointing_test {

using namespace obscura;
using namespace obscura::tools;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using obscura::images::Image;

namespace {

scene::Camera camera(double row_pitch_m) {
    scene::Camera c;
    c.width = 160;
    c.height = 90;
    c.pixel_pitch_m = 10e-6;
    c.pixel_pitch_y_m = row_pitch_m;
    c.focal_length_m = 8e-3;
    return c;
}

/// Blobs at random directions, as a camera with the attitude `q` (camera to sky) sees them. The lens is
/// written out here: x right, y down over the focal length.
Image sky(const scene::Camera& c, Quat q, double noise, unsigned seed) {
    std::mt19937 places(7), random(seed);
    std::normal_distribution<double> normal;
    Image image{c.width, c.height,
                std::vector<double>(static_cast<std::size_t>(c.width) * static_cast<std::size_t>(c.height))};
    for (int blob = 0; blob < 60; ++blob) {
        const double u = (static_cast<double>(places() % 1000) / 1000 - 0.5) * 0.24,
                     v = (static_cast<double>(places() % 1000) / 1000 - 0.5) * 0.24;
        const double width = 0.003 + 0.00004 * static_cast<double>(places() % 100);
        const Vec3 d = rotate(conjugate(q), normalized(Vec3{u, v, 1}));
        for (std::int32_t j = 0; j < c.height; ++j)
            for (std::int32_t i = 0; i < c.width; ++i) {
                const double x = (i - (c.width - 1) / 2.0) * c.pixel_pitch_m / c.focal_length_m,
                             y = (j - (c.height - 1) / 2.0) * c.row_pitch_m() / c.focal_length_m;
                const Vec3 away = normalized(Vec3{x, y, 1}) - d;
                image.values[static_cast<std::size_t>(j * c.width + i)] +=
                    std::exp(-0.5 * dot(away, away) / (width * width));
            }
    }
    for (double& v : image.values)
        v += noise * normal(random);
    return image;
}

/// Turns the boresight right (about y), then down (about -x), then rolls (about z).
Quat turn(double right, double down, double roll) {
    return axis_angle({0, 1, 0}, right) * axis_angle({1, 0, 0}, -down) * axis_angle({0, 0, 1}, roll);
}

/// Angle of the rotation between two attitudes.
double apart(Quat a, Quat b) {
    return 2 * std::acos(std::min(1.0, std::abs(dot(a, b))));
}

} // namespace

TEST_CASE("a turned camera's angles come back, with square and rectangular pixels") {
    for (const double row_pitch_m : {10e-6, 17e-6}) {
        const scene::Camera c = camera(row_pitch_m);
        const auto lens = renderer::make_projection(c);
        const double pixel = c.pixel_pitch_m / c.focal_length_m;
        const Image image = sky(c, Quat{}, 0, 1);
        const double turns[][3] = {{0, 0, 0}, {0.7, -0.3, 0.004}, {-5.2, 2.6, -0.03}, {3.1, -4.4, 0.05}};
        for (const auto& [right, down, roll] : turns) {
            CAPTURE(row_pitch_m, right, down, roll);
            const Quat q = turn(right * pixel, down * pixel, roll);
            const PointingFit fit = fit_pointing(sky(c, q, 0, 1), image, *lens, {8, 0.06});
            // A roll of 1e-4 moves the image by 0.008 px at its sides.
            CHECK(apart(fit.pointing.turn(), q) < 1e-4);
            const auto ahead = [&](Quat turned) { return rotate(turned, {0, 0, 1}); };
            CHECK(length(ahead(fit.pointing.turn()) - ahead(q)) < 0.01 * pixel);
            CHECK(fit.correlation > 0.9995);
            // For small angles they are the three of the turn.
            CHECK_THAT(fit.pointing.right_rad, WithinAbs(right * pixel, 0.15 * pixel));
            CHECK_THAT(fit.pointing.down_rad, WithinAbs(down * pixel, 0.15 * pixel));
            CHECK_THAT(fit.pointing.roll_rad, WithinAbs(roll, 0.001));
            const Agreement a =
                compare_images(sky(c, q, 0, 1), turned(image, *lens, fit.pointing), {0, true});
            CHECK(a.correlation > 0.999);
            CHECK_THAT(a.scale, WithinRel(1, 0.02));
        }
    }
}

TEST_CASE("the standard errors of a pointing are what fits scatter by, and none is given without structure") {
    const scene::Camera c = camera(17e-6);
    const auto lens = renderer::make_projection(c);
    const double pixel = c.pixel_pitch_m / c.focal_length_m;
    const Quat q = turn(0.4 * pixel, 0.3 * pixel, 0.003);
    double squares[3] = {};
    constexpr int pairs = 8;
    for (unsigned i = 0; i < pairs; ++i) {
        const PointingFit fit =
            fit_pointing(sky(c, q, 0.1, 10 + i), sky(c, Quat{}, 0.1, 100 + i), *lens, {3, 0.01});
        squares[0] += std::pow((fit.pointing.right_rad - 0.4 * pixel) / fit.error.right_rad, 2) / pairs;
        squares[1] += std::pow((fit.pointing.down_rad - 0.3 * pixel) / fit.error.down_rad, 2) / pairs;
        squares[2] += std::pow((fit.pointing.roll_rad - 0.003) / fit.error.roll_rad, 2) / pairs;
    }
    // Chi-square with 8 degrees of freedom, 99.9 % on either side, and 64 blocks to estimate from.
    for (const double square : squares) {
        CHECK(std::sqrt(square) > 0.3);
        CHECK(std::sqrt(square) < 2);
    }
    // Stripes along the rows: the pointing right is not determined.
    Image stripes{c.width, c.height, {}};
    for (std::int32_t y = 0; y < c.height; ++y)
        for (std::int32_t x = 0; x < c.width; ++x)
            stripes.values.push_back(std::sin(y * 0.5) + 0.2 * std::sin(y * 0.11));
    const PointingFit fit = fit_pointing(stripes, stripes, *lens, {3, 0.01});
    CHECK(!(fit.error.right_rad < 3 * pixel));
}

TEST_CASE("a pointing that ends at a limit of the search says which, without errors") {
    const scene::Camera c = camera(10e-6);
    const auto lens = renderer::make_projection(c);
    const double pixel = c.pixel_pitch_m / c.focal_length_m;
    const Image image = sky(c, Quat{}, 0.02, 1);
    // Right is beyond 3 px, down beyond 3 px, the roll beyond 0.01 rad, and all within.
    const double turns[][3] = {{4.5, 0.5, 0}, {0.5, -4.5, 0}, {0.5, 0.5, 0.02}, {2.6, 0.5, 0.004}};
    for (std::size_t i = 0; i < std::size(turns); ++i) {
        CAPTURE(i);
        const Quat q = turn(turns[i][0] * pixel, turns[i][1] * pixel, turns[i][2]);
        const PointingFit fit = fit_pointing(sky(c, q, 0.02, 2), image, *lens, {3, 0.01});
        CHECK(fit.right_at_limit == (i == 0));
        CHECK(fit.down_at_limit == (i == 1));
        CHECK(fit.roll_at_limit == (i == 2));
        CHECK(fit.limit_px == 3);
        for (const double error : {fit.error.right_rad, fit.error.down_rad, fit.error.roll_rad})
            CHECK(std::isfinite(error) == (i == 3));
        // A shift alone.
        if (i == 2) continue;
        const Agreement a = compare_images(sky(c, q, 0.02, 2), image, {3, true});
        CHECK(a.at_limit_x == (i == 0));
        CHECK(a.at_limit_y == (i == 1));
        CHECK(std::isfinite(a.error_x_px) == (i == 3));
        CHECK(std::isfinite(a.error_y_px) == (i == 3));
    }
    // A roll that is not searched for is no limit that it ends at.
    const PointingFit still = fit_pointing(sky(c, turn(0.5 * pixel, 0, 0), 0.02, 2), image, *lens, {3, 0});
    CHECK(!still.at_limit());
    CHECK(std::isfinite(still.error.right_rad));
}

TEST_CASE("pixels that are missing are left out of a pointing fit") {
    const scene::Camera c = camera(10e-6);
    const auto lens = renderer::make_projection(c);
    const double pixel = c.pixel_pitch_m / c.focal_length_m;
    Image image = sky(c, Quat{}, 0, 1);
    const Image reference = sky(c, turn(1.3 * pixel, 0, 0), 0, 1);
    for (int i = 0; i < 20; ++i)
        image.values[static_cast<std::size_t>(40 * c.width + 3 * i)] = std::nan("");
    const PointingFit fit = fit_pointing(reference, image, *lens, {3, 0.01});
    CHECK_THAT(fit.pointing.right_rad, WithinAbs(1.3 * pixel, 0.02 * pixel));
    CHECK_THROWS_AS(fit_pointing(reference, Image{2, 2, {1, 2, 3, 4}}, *lens, {3, 0.01}), InputError);
}

TEST_CASE("I/F of a Lambert surface under the vertical Sun is its albedo") {
    const scene::Camera c = camera(17e-6);
    const auto lens = renderer::make_projection(c);
    const double sun_w_m2 = 400, albedo = 0.31, radiance = albedo * sun_w_m2 / std::numbers::pi;
    Image irradiance{c.width, c.height, {}};
    for (std::int32_t y = 0; y < c.height; ++y)
        for (std::int32_t x = 0; x < c.width; ++x) {
            const double u = (x - 79.5) * 10e-6 / 8e-3, v = (y - 44.5) * 17e-6 / 8e-3;
            irradiance.values.push_back(radiance * 10e-6 * 17e-6 / 64e-6 / std::pow(1 + u * u + v * v, 1.5));
        }
    for (const double value : i_over_f(irradiance, *lens, false, sun_w_m2).values)
        CHECK_THAT(value, WithinRel(albedo, 1e-9));
    const Image constant{c.width, c.height, std::vector<double>(irradiance.values.size(), radiance)};
    CHECK_THAT(i_over_f(constant, *lens, true, sun_w_m2).at(3, 7), WithinRel(albedo, 1e-9));
}

} // namespace pointing_test
