// SPDX-License-Identifier: Apache-2.0
// Pixels with two pitches: projections against formulas in lengths on the focal plane, solid angles against
// the exact ones of rectangles, light of stars and bodies, and second moments of images.
#include "core/error.hpp"
#include "renderer/camera/lens.hpp"
#include "renderer/camera/pinhole.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fitsio.h>

namespace rectangular_pixels_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double column_m = 16e-6, row_m = 27e-6;

scene::Camera camera_with(double focal_m, std::int32_t width, std::int32_t height) {
    scene::Camera c;
    c.width = width;
    c.height = height;
    c.pixel_pitch_m = column_m;
    c.pixel_pitch_y_m = row_m;
    c.focal_length_m = focal_m;
    return c;
}

Vec3 seen_at(const renderer::Projection& lens, double x, double y, double* weight_sr = nullptr) {
    Doubles xs, ys, weight;
    for (int i = 0; i < packet_size; ++i)
        xs[i] = x, ys[i] = y;
    Vec3s d;
    lens.rays(xs, ys, d, weight);
    if (weight_sr != nullptr) *weight_sr = weight[3];
    return d.lane(3);
}

/// Solid angle of the rectangle from the axis to (a, b) on a plane at distance 1.
double corner_sr(double a, double b) {
    return std::atan2(a * b, std::sqrt(1 + a * a + b * b));
}

struct Moments {
    double light = 0, x = 0, y = 0, xx = 0, yy = 0;
};
Moments moments(const Image& image) {
    Moments m;
    for (int j = 0; j < image.height; ++j)
        for (int i = 0; i < image.width; ++i) {
            const auto v = static_cast<double>(image.at(i, j));
            m.light += v, m.x += i * v, m.y += j * v;
        }
    m.x /= m.light, m.y /= m.light;
    for (int j = 0; j < image.height; ++j)
        for (int i = 0; i < image.width; ++i) {
            const auto v = static_cast<double>(image.at(i, j));
            m.xx += (i - m.x) * (i - m.x) * v, m.yy += (j - m.y) * (j - m.y) * v;
        }
    m.xx /= m.light, m.yy /= m.light;
    return m;
}

/// A camera along +x of the given pitches, f/8, and a star a fraction of a pixel off its axis.
scene::Scene star_scene(double pitch_x_m, double pitch_y_m, std::int32_t size) {
    scene::Scene s;
    s.sun.irradiance_scale = 0;
    s.bands = {{549.9e-9, 550.1e-9}};
    s.camera.width = s.camera.height = size;
    s.camera.focal_length_m = 0.8;
    s.camera.aperture_m = 0.1;
    s.camera.pixel_pitch_m = pitch_x_m;
    s.camera.pixel_pitch_y_m = pitch_y_m;
    s.camera.motion.samples[0].pose.orientation = look_along({1, 0, 0}, {0, 0, 1});
    const Vec3 d = rotate(s.camera.motion.samples[0].pose.orientation,
                          normalized(Vec3{0.3 * pitch_x_m / 0.8, -0.2 * pitch_y_m / 0.8, 1}));
    s.stars.push_back({std::atan2(d.y, d.x), std::asin(d.z), 0, 0.5});
    return s;
}

double star_light(const scene::Scene& s) {
    return star_irradiance_w_m2({0, 0, 0, 0.5}, s.bands[0]);
}

/// A ball of radiance 1, `radius_m` on the focal plane in radius.
scene::Scene ball_scene(double pitch_x_m, double pitch_y_m, std::int32_t size, double radius_m) {
    scene::Scene s = star_scene(pitch_x_m, pitch_y_m, size);
    s.stars.clear();
    const double distance_m = 1e6, ball_m = radius_m / 0.8 * distance_m;
    s.bodies.push_back({"lamp", EllipsoidParameters{{ball_m, ball_m, ball_m}}, LambertParameters{0}, {}});
    s.bodies[0].emission_w_m2_sr = {1};
    s.bodies[0].motion.samples[0].pose.position_m = {distance_m, 0, 0};
    return s;
}

} // namespace

TEST_CASE("Directions of rectangular pixels are those of their places on the focal plane", "[renderer]") {
    scene::Camera c = camera_with(5e-3, 537, 244);
    const auto pinhole = make_projection(c);
    REQUIRE(dynamic_cast<const Pinhole*>(pinhole.get()) != nullptr);
    c.projection = scene::Projection::equidistant;
    const auto fisheye = make_projection(c);
    c.projection = scene::Projection::pinhole;
    c.sensor_rotation_rad = 0.3;
    c.principal_offset_px = {20, -11};
    // Real to ideal, in radii over the focal length: r (1 + k1 r^2).
    c.distortion.model = scene::Distortion::Model::brown_conrady;
    c.distortion.coefficients = {0.02};
    const auto bent = make_projection(c);
    for (double x = 0; x < 537; x += 53.6)
        for (double y = 0; y < 244; y += 24.3) {
            CAPTURE(x, y);
            const double u_m = (x - 268) * column_m, v_m = (y - 121.5) * row_m;
            CHECK(length(seen_at(*pinhole, x, y) - normalized(Vec3{u_m, v_m, 5e-3})) < 1e-12);
            const double r_m = std::max(std::hypot(u_m, v_m), 1e-30), angle = r_m / 5e-3;
            CHECK(length(seen_at(*fisheye, x, y) -
                         Vec3{std::sin(angle) * u_m / r_m, std::sin(angle) * v_m / r_m, std::cos(angle)}) <
                  1e-12);
            const double a_m = u_m - 20 * column_m, b_m = v_m + 11 * row_m;
            const double p = (std::cos(0.3) * a_m - std::sin(0.3) * b_m) / 5e-3,
                         q = (std::sin(0.3) * a_m + std::cos(0.3) * b_m) / 5e-3;
            const double k = 1 + 0.02 * (p * p + q * q);
            CHECK(length(seen_at(*bent, x, y) - normalized(Vec3{p * k, q * k, 1})) < 1e-9);
            for (const auto* lens : {pinhole.get(), fisheye.get(), bent.get()}) {
                const auto back = lens->project(seen_at(*lens, x, y));
                REQUIRE(back);
                CHECK_THAT(back->x, WithinAbs(x, 1e-6));
                CHECK_THAT(back->y, WithinAbs(y, 1e-6));
            }
        }
}

TEST_CASE("The solid angles of rectangular pixels add up to that of the field", "[renderer]") {
    scene::Camera c = camera_with(5e-3, 537, 244);
    const double a = 537 * column_m / 2 / 5e-3, b = 244 * row_m / 2 / 5e-3;
    const double exact = 4 * corner_sr(a, b);
    for (const bool general : {false, true}) {
        // A rotation of none whole turn makes a Lens of the same pinhole.
        c.sensor_rotation_rad = general ? 2 * pi : 0;
        const auto lens = make_projection(c);
        CHECK((dynamic_cast<const Lens*>(lens.get()) != nullptr) == general);
        double sum = 0;
        for (int y = 0; y < 244; ++y)
            for (int x = 0; x < 537; ++x)
                sum += lens->solid_angle_sr(x, y);
        CHECK_THAT(sum, WithinRel(exact, 1e-5));
        double weight = 0;
        (void)seen_at(*lens, 17, 200, &weight);
        CHECK_THAT(weight, WithinRel(lens->solid_angle_sr(17, 200), 1e-12));
        // Corner of the field, and the pixels' angles.
        CHECK(lens->field_angle_rad(0) >= std::atan(std::hypot(a, b)) - 1e-9);
        CHECK(lens->pixel_angle_rad() >= row_m / 5e-3 * (1 - 1e-6));
        CHECK_THAT(lens->local_pixel_angle_rad({0, 0, 1}), WithinRel(column_m / 5e-3, 1e-3));
    }
}

TEST_CASE("A star keeps its light in rectangular pixels, and its image is round on the focal plane",
          "[renderer]") {
    for (const double ratio : {0.4, 27.0 / 16, 5.0}) {
        scene::Scene s = star_scene(10e-6, ratio * 10e-6, 192);
        s.camera.psf_sigma_px = 4;
        CAPTURE(ratio);
        const Image image = render(Renderer(s, {}));
        const Moments m = moments(image);
        CHECK_THAT(m.light, WithinRel(star_light(s), 1e-4));
        CHECK_THAT(m.x, WithinAbs(95.5 + 0.3, 1e-3));
        CHECK_THAT(m.y, WithinAbs(95.5 - 0.2, 1e-3));
        // A pixel has the second moment 1/12 itself.
        CHECK_THAT(m.xx, WithinRel(16 + 1.0 / 12, 1e-3));
        CHECK_THAT(m.yy, WithinRel(16 / (ratio * ratio) + 1.0 / 12, 1e-3));
    }
}

TEST_CASE("Defocus and diffraction are round on the focal plane of rectangular pixels", "[renderer]") {
    for (const double ratio : {0.5, 27.0 / 16, 4.0}) {
        CAPTURE(ratio);
        scene::Scene s = star_scene(10e-6, ratio * 10e-6, 128);
        s.camera.psf_sigma_px = 1;
        s.camera.psf.core_px = 24;
        // A disc of 12 px in radius at f/8: its second moment is R^2 / 4.
        s.camera.psf.defocus_m = 2 * 8 * 120e-6;
        const Moments m = moments(render(Renderer(s, {})));
        CHECK_THAT(m.light, WithinRel(star_light(s), 2e-3));
        CHECK_THAT(m.xx, WithinRel(36 + 1 + 1.0 / 12, 0.01));
        CHECK_THAT(m.yy, WithinRel(37 / (ratio * ratio) + 1.0 / 12, 0.01));
    }
    // Encircled energy of the Airy pattern, 1 - J0(v)^2 - J1(v)^2 (Born and Wolf 8.5.2).
    for (const double ratio : {0.5, 3.0}) {
        CAPTURE(ratio);
        scene::Scene s = star_scene(550e-9 * 8 / 4, ratio * 550e-9 * 8 / 4, 401);
        s.stars[0] = {0, 0, 0, 0.5}; // on the axis
        s.camera.psf.model = scene::PointSpread::Model::airy;
        s.camera.psf.core_px = 100;
        const Image image = render(Renderer(s, {}));
        for (const double radius : {10.0, 60.0}) {
            CAPTURE(radius);
            double inside = 0;
            for (int y = 0; y < 401; ++y)
                for (int x = 0; x < 401; ++x) {
                    // The share of the pixel that lies in the circle, by points.
                    constexpr int n = 12;
                    int count = 0;
                    for (int j = 0; j < n; ++j)
                        for (int i = 0; i < n; ++i)
                            count += std::hypot(x - 200 + (i + 0.5) / n - 0.5,
                                                ratio * (y - 200 + (j + 0.5) / n - 0.5)) < radius
                                         ? 1
                                         : 0;
                    inside += static_cast<double>(image.at(x, y)) * count / (n * n);
                }
            const double v = pi * radius / 4;
            const double j0 = std::cyl_bessel_j(0, v), j1 = std::cyl_bessel_j(1, v);
            CHECK_THAT(inside / star_light(s), WithinAbs(1 - j0 * j0 - j1 * j1, 0.012));
        }
    }
}

TEST_CASE("A disc's second moments have the ratio of the pitches, and its light is that of the solid angle",
          "[renderer]") {
    for (const double ratio : {0.4, 27.0 / 16, 4.0}) {
        CAPTURE(ratio);
        // 30 columns in radius.
        scene::Scene s = ball_scene(10e-6, ratio * 10e-6, 192, 300e-6);
        s.camera.psf_sigma_px = 0;
        RenderSettings settings;
        settings.samples_per_pixel = 32;
        const Moments m = moments(render(Renderer(s, settings)));
        const double solid_angle = pi * 300e-6 * 300e-6 / (0.8 * 0.8);
        CHECK_THAT(m.light, WithinRel(solid_angle, 2e-3));
        CHECK_THAT(m.xx - 1.0 / 12, WithinRel(225, 0.01));
        CHECK_THAT((m.xx - 1.0 / 12) / (m.yy - 1.0 / 12), WithinRel(ratio * ratio, 0.01));
    }
}

TEST_CASE("Small bodies keep their light in rectangular pixels", "[renderer]") {
    // Radius in columns: below a pixel, about one, and some.
    for (const double radius : {0.05, 0.6, 2.0, 5.0})
        for (const double ratio : {0.25, 27.0 / 16, 8.0}) {
            CAPTURE(radius, ratio);
            scene::Scene s = ball_scene(10e-6, ratio * 10e-6, 64, radius * 10e-6);
            s.camera.psf_sigma_px = 0.7;
            RenderSettings settings;
            settings.samples_per_pixel = 16;
            const double light = render(Renderer(s, settings)).sum();
            CHECK_THAT(light / (pi * radius * radius * 1e-10 / 0.64), WithinRel(1, 0.02));
        }
}

TEST_CASE("A tabulated PSF is square on the focal plane, or has samples of its own along the columns",
          "[renderer]") {
    const TempFolder folder;
    // A Gaussian of 2 px across and `down` rows, in samples of 1/8 px across and 1/`oversamy` rows.
    const auto file_with = [&](const std::string& name, double across, double down, double oversamy) {
        constexpr long side = 161;
        std::vector<double> values;
        for (int j = 0; j < side; ++j)
            for (int i = 0; i < side; ++i) {
                const double x = (i - 80) / across, y = (j - 80) / down;
                values.push_back(std::exp(-(x * x + y * y) / 2));
            }
        const std::string file = (folder.path() / name).string();
        fitsfile* fits = nullptr;
        int status = 0;
        long size[2] = {side, side};
        double oversamp = 8;
        fits_create_diskfile(&fits, file.c_str(), &status);
        fits_create_img(fits, DOUBLE_IMG, 2, size, &status);
        fits_write_key(fits, TDOUBLE, "OVERSAMP", &oversamp, nullptr, &status);
        if (oversamy > 0) fits_write_key(fits, TDOUBLE, "OVERSAMY", &oversamy, nullptr, &status);
        fits_write_img(fits, TDOUBLE, 1, side * side, values.data(), &status);
        fits_close_file(fits, &status);
        REQUIRE(status == 0);
        return file;
    };
    scene::Scene s = star_scene(10e-6, 20e-6, 64);
    s.camera.psf.model = scene::PointSpread::Model::table;
    s.camera.psf.core_px = 16;
    // 16 samples are 2 columns; square samples: one row of twice the pitch.
    s.camera.psf.file = file_with("square.fits", 16, 16, 0);
    Moments m = moments(render(Renderer(s, {})));
    CHECK_THAT(m.light, WithinRel(star_light(s), 2e-3));
    CHECK_THAT(m.xx, WithinRel(4 + 1.0 / 12, 0.02));
    CHECK_THAT(m.yy, WithinRel(1 + 1.0 / 12, 0.02));
    // 8 samples a row: 16 of them are two rows.
    s.camera.psf.file = file_with("own.fits", 16, 16, 8);
    m = moments(render(Renderer(s, {})));
    CHECK_THAT(m.light, WithinRel(star_light(s), 2e-3));
    CHECK_THAT(m.xx, WithinRel(4 + 1.0 / 12, 0.02));
    CHECK_THAT(m.yy, WithinRel(4 + 1.0 / 12, 0.02));
    s.camera.psf.file = file_with("wrong.fits", 16, 16, 1000);
    CHECK_THROWS_WITH(Renderer(s, {}), ContainsSubstring("OVERSAMY 1000"));
}

TEST_CASE("A line camera of one row sees the line, with its own pitch down", "[renderer]") {
    scene::Scene s = ball_scene(5e-6, 40e-6, 1, 1e-3);
    s.camera.width = 1024;
    s.camera.height = 1;
    s.camera.psf_sigma_px = 0.5;
    RenderSettings settings;
    settings.samples_per_pixel = 16;
    const Image line = render(Renderer(s, settings));
    // Radiance 1 in 400 columns of 5 um by 40 um.
    CHECK_THAT(static_cast<double>(line.at(511, 0)), WithinRel(5e-6 * 40e-6 / 0.64, 1e-3));
    CHECK_THAT(line.sum(), WithinRel(400 * 5e-6 * 40e-6 / 0.64, 2e-3));
    CHECK(line.at(300, 0) == 0);
}

TEST_CASE("A pitch of the rows far from that of the columns is refused, and 0 means square", "[renderer]") {
    scene::Scene s = star_scene(10e-6, 0, 16);
    CHECK(s.camera.row_pitch_m() == 10e-6);
    CHECK(s.camera.pixel_aspect() == 1);
    const Image square = render(Renderer(s, {}));
    s.camera.pixel_pitch_y_m = 10e-6;
    CHECK(render(Renderer(s, {})).values == square.values);
    s.camera.pixel_pitch_y_m = 400e-6;
    CHECK_THROWS_WITH(Renderer(s, {}),
                      ContainsSubstring("pixel_pitch_y_um: 400 is out of range beside pixel_pitch_um = 10, "
                                        "allowed 0 or 0.3125 to 320"));
}

} // namespace rectangular_pixels_test
