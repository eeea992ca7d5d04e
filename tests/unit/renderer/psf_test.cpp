// SPDX-License-Identifier: Apache-2.0
// Point spread functions: diffraction, defocus, tables by place and band; drawn and splatted alike.
#include "core/error.hpp"
#include "psf_planes.hpp"
#include "renderer/camera/psf.hpp"
#include "renderer/camera/psf_profile.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <string>

namespace psf_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;

double bessel0(double x) {
    return std::cyl_bessel_j(0, x);
}
double bessel1(double x) {
    return std::cyl_bessel_j(1, x);
}

/// Light within the radius of the Airy pattern of an annular aperture (Mahajan, Optical Imaging and
/// Aberrations II, 2.3), v = pi r / (lambda N).
double encircled(double v, double e) {
    double cross = 0;
    constexpr int steps = 20000;
    for (int i = 0; i < steps; ++i) {
        const double t = v * (i + 0.5) / steps;
        cross += bessel1(t) * bessel1(e * t) / t * v / steps;
    }
    const double full = 1 - bessel0(v) * bessel0(v) - bessel1(v) * bessel1(v);
    const double hole = 1 - bessel0(e * v) * bessel0(e * v) - bessel1(e * v) * bessel1(e * v);
    return (full + e * e * hole - 4 * e * cross) / (1 - e * e);
}

/// A camera of f/8 whose pixels are such that lambda N is `airy_px` of them at 550 nm.
scene::Scene airy_scene(double airy_px, double obscuration, std::int32_t size) {
    scene::Scene s;
    s.bands = {{549.9e-9, 550.1e-9}};
    s.camera.width = s.camera.height = size;
    s.camera.focal_length_m = 0.8;
    s.camera.aperture_m = 0.1;
    s.camera.pixel_pitch_m = 550e-9 * 8 / airy_px;
    s.camera.psf.model = scene::PointSpread::Model::airy;
    s.camera.psf.obscuration = obscuration;
    s.camera.motion.samples[0].pose.orientation = look_along({1, 0, 0}, {0, 0, 1});
    return s;
}

/// A star that is seen (dx, dy) pixels off the centre.
void add_star(scene::Scene& s, double dx, double dy) {
    const double scale = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const Vec3 d =
        rotate(s.camera.motion.samples[0].pose.orientation, normalized(Vec3{dx * scale, dy * scale, 1}));
    s.stars.push_back({std::atan2(d.y, d.x), std::asin(d.z), 0, 0.5});
}

double star_light(const scene::Scene& s, std::size_t band = 0) {
    return renderer::star_irradiance_w_m2({0, 0, 0, 0.5}, s.bands[band]);
}

/// An image of a Gaussian of that width, moved by (dx, dy) pixels.
Plane gaussian(double sigma_px, double dx = 0, double dy = 0) {
    Plane p;
    p.side = 161;
    p.oversampling = 8;
    for (int j = 0; j < p.side; ++j)
        for (int i = 0; i < p.side; ++i) {
            const double x = (i - 80) / 8.0 - dx;
            const double y = (j - 80) / 8.0 - dy;
            p.values.push_back(std::exp(-(x * x + y * y) / (2 * sigma_px * sigma_px)));
        }
    return p;
}

struct Moments {
    double sum = 0, x = 0, y = 0, width2 = 0;
};
Moments moments(const Image& image) {
    Moments m;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x) {
            const auto v = static_cast<double>(image.at(x, y));
            m.sum += v;
            m.x += v * x;
            m.y += v * y;
        }
    m.x /= m.sum;
    m.y /= m.sum;
    for (int y = 0; y < image.height; ++y)
        for (int x = 0; x < image.width; ++x)
            m.width2 += static_cast<double>(image.at(x, y)) *
                        ((x - m.x) * (x - m.x) + (y - m.y) * (y - m.y)) / 2 / m.sum;
    return m;
}

scene::Scene table_scene(const std::string& file, std::int32_t size) {
    scene::Scene s = airy_scene(1, 0, size);
    s.camera.psf.model = scene::PointSpread::Model::table;
    s.camera.psf.file = file;
    s.camera.psf.core_px = 8;
    return s;
}

} // namespace

TEST_CASE("The encircled energy of an Airy pattern is the analytic one within 0.2 %, core and wings") {
    for (const double obscuration : {0.0, 0.35}) {
        INFO("obscuration " << obscuration);
        scene::Scene s = airy_scene(12, obscuration, 16);
        s.camera.psf.core_px = 64;
        s.camera.psf.wings_px = 400;
        const auto psf = renderer::Psf::make(s.camera, s.bands);
        REQUIRE(psf);
        const double step = 0.5;
        std::array<double, 5> radii{8, 16, 30, 60, 120};
        std::array<double, 5> light{};
        for (double y = -120.25; y < 121; y += step)
            for (double x = -120.25; x < 121; x += step) {
                const double r2 = x * x + y * y;
                const double share = psf->weight({-x, -y}, 0, 0, 0) + psf->wing(0, 0, r2);
                for (std::size_t k = 0; k < radii.size(); ++k)
                    if (r2 < radii[k] * radii[k]) light[k] += share * step * step;
            }
        for (std::size_t k = 0; k < radii.size(); ++k) {
            INFO("radius " << radii[k] << " px");
            CHECK_THAT(light[k], WithinAbs(encircled(pi * radii[k] / 12, obscuration), 2e-3));
        }
    }
}

TEST_CASE("A star through an aperture keeps its light and its place") {
    scene::Scene s = airy_scene(1.7, 0.3, 48);
    add_star(s, 3.3, -2.7);
    const Moments m = moments(render(renderer::Renderer(s, {})));
    CHECK_THAT(m.sum, WithinRel(star_light(s), 1e-4));
    CHECK_THAT(m.x, WithinAbs(23.5 + 3.3, 1e-3));
    CHECK_THAT(m.y, WithinAbs(23.5 - 2.7, 1e-3));
}

TEST_CASE("A star outside the field leaves its wings in the picture") {
    scene::Scene s = airy_scene(3, 0, 64);
    s.camera.psf.core_px = 8;
    s.camera.psf.wings_px = 200;
    add_star(s, 60, 0); // 28.5 px beyond the right edge
    const Image image = render(renderer::Renderer(s, {}));
    // Means over some rings, against (2 J1(v) / v)^2.
    for (const int first : {2, 20, 40}) {
        double seen = 0;
        double expected = 0;
        for (int y = 26; y < 38; ++y)
            for (int x = first; x < first + 18; ++x) {
                seen += static_cast<double>(image.at(x, y));
                const double v = pi * std::hypot(31.5 + 60 - x, y - 31.5) / 3;
                expected += pi / 4 / 9 * 4 * bessel1(v) * bessel1(v) / (v * v);
            }
        INFO("from column " << first);
        CHECK_THAT(seen / star_light(s), WithinRel(expected, 0.03));
    }
    s.camera.psf.wings_px = 0;
    CHECK(render(renderer::Renderer(s, {})).sum() == 0);
}

TEST_CASE("A bright body outside the field leaves its wings, resolved or not") {
    for (const double radius_px : {2.0, 15.0}) {
        INFO("radius " << radius_px);
        scene::Scene s = airy_scene(3, 0, 64);
        s.sun.irradiance_scale = 0;
        s.camera.psf.core_px = 8;
        s.camera.psf.wings_px = 300;
        const double scale = s.camera.pixel_pitch_m / s.camera.focal_length_m;
        const double distance = 1e6;
        s.bodies.push_back(
            {"lamp", renderer::EllipsoidParameters{{1, 1, 1}}, renderer::LambertParameters{0}, {}});
        const double radius_m = radius_px * scale * distance;
        s.bodies[0].shape = renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}};
        s.bodies[0].emission_w_m2_sr = {1};
        s.bodies[0].motion.samples[0].pose.position_m =
            rotate(s.camera.motion.samples[0].pose.orientation, {80 * scale * distance, 0, distance});
        const double light = pi * radius_px * radius_px * scale * scale;
        const Image image = render(renderer::Renderer(s, {}));
        double seen = 0;
        double expected = 0;
        for (int y = 16; y < 48; ++y)
            for (int x = 0; x < 48; ++x) {
                seen += static_cast<double>(image.at(x, y));
                // The mean over the rings: that of the square of J1(v) is 1 / (pi v).
                const double v = pi * std::hypot(31.5 + 80 - x, y - 31.5) / 3;
                // Over a disc r^-3 has the mean of its middle and R^2 / 8 of its Laplacian, 9 r^-5.
                const double wide = 1 + 9.0 / 8 * radius_px * radius_px * pi * pi / 9 / (v * v);
                expected += wide * pi / 4 / 9 * 4 / (pi * v * v * v);
            }
        CHECK_THAT(seen / light, WithinRel(expected, 0.03));
    }
}

TEST_CASE("Shorter waves are seen sharper, and colours keep their light") {
    scene::Scene s = airy_scene(2, 0, 64);
    s.bands = {{449e-9, 451e-9}, {899e-9, 901e-9}};
    s.camera.psf.core_px = 24;
    add_star(s, 0.2, 0.1);
    const std::vector<float> frame = render_window(renderer::Renderer(s, {}), {0, 0, 64, 64});
    double peak[2] = {};
    for (std::size_t band = 0; band < 2; ++band) {
        double sum = 0;
        for (std::size_t i = 0; i < 64 * 64; ++i) {
            const auto v = static_cast<double>(frame[band * 64 * 64 + i]);
            sum += v / star_light(s, band);
            peak[band] = std::max(peak[band], v / star_light(s, band));
        }
        CHECK_THAT(sum, WithinRel(1.0, 1e-4));
    }
    // The pixel's own size takes the edge off the ratio of 4.
    CHECK(peak[0] / peak[1] > 2.7);
    CHECK(peak[0] / peak[1] < 4);

    // A body is sampled with what stars are splatted with: the same flux in each band as without a PSF.
    scene::Scene ball = sphere_scene(renderer::LambertParameters{0.3}, 0.5, 12, 64);
    ball.bands = s.bands;
    ball.camera.psf_sigma_px = 0;
    const std::vector<float> sharp = render_window(renderer::Renderer(ball, {64, 2, 1}), {0, 0, 64, 64});
    ball.camera.psf = s.camera.psf;
    ball.camera.psf.core_px = 16;
    ball.camera.aperture_m = ball.camera.focal_length_m * 450e-9 / ball.camera.pixel_pitch_m;
    const std::vector<float> soft = render_window(renderer::Renderer(ball, {64, 2, 1}), {0, 0, 64, 64});
    double edge[2] = {};
    for (std::size_t band = 0; band < 2; ++band) {
        double before = 0;
        double after = 0;
        for (std::size_t i = 0; i < 64 * 64; ++i) {
            before += static_cast<double>(sharp[band * 64 * 64 + i]);
            after += static_cast<double>(soft[band * 64 * 64 + i]);
            if (sharp[band * 64 * 64 + i] == 0) edge[band] += static_cast<double>(soft[band * 64 * 64 + i]);
        }
        CHECK_THAT(after, WithinRel(before, 2e-3));
        edge[band] /= after;
    }
    CHECK(edge[1] > 1.5 * edge[0]); // red spills farther over the limb
}

TEST_CASE("A table is put the right way up, for stars and for what is sampled") {
    const TempFolder folder;
    // Three quarters in the middle, a quarter 3 px to the right and 1 px down.
    Plane two = gaussian(0.4);
    const Plane beside = gaussian(0.4, 3, 1);
    for (std::size_t i = 0; i < two.values.size(); ++i)
        two.values[i] = 0.75 * two.values[i] + 0.25 * beside.values[i];
    const std::string file = write_fits(folder, "two.fits", {two});
    scene::Scene s = table_scene(file, 48);
    add_star(s, 0, 0);
    const Moments m = moments(render(renderer::Renderer(s, {})));
    CHECK_THAT(m.sum, WithinRel(star_light(s), 1e-3));
    CHECK_THAT(m.x, WithinAbs(23.5 + 0.75, 2e-3));
    CHECK_THAT(m.y, WithinAbs(23.5 + 0.25, 2e-3));
    for (const double radius_px : {2.5, 10.0}) { // splatted, sampled
        INFO("radius " << radius_px);
        scene::Scene ball = sphere_scene(renderer::LambertParameters{0}, 0.5, radius_px, 48);
        ball.sun.irradiance_scale = 0;
        ball.bodies[0].emission_w_m2_sr = {1};
        const Moments before = moments(render(renderer::Renderer(ball, {512, 2, 1})));
        ball.camera.psf = s.camera.psf;
        const Moments after = moments(render(renderer::Renderer(ball, {512, 2, 1})));
        CHECK_THAT(after.sum, WithinRel(before.sum, 2e-3));
        CHECK_THAT(after.x - before.x, WithinAbs(0.75, 0.01));
        CHECK_THAT(after.y - before.y, WithinAbs(0.25, 0.01));
    }
}

TEST_CASE("A table of places: the PSF changes over the field, and between its places by degrees") {
    const TempFolder folder;
    std::vector<Plane> planes;
    for (const double x : {0.0, 100.0}) {
        Plane p = gaussian(x == 0 ? 0.6 : 1.5);
        p.x = x;
        planes.push_back(p);
    }
    scene::Scene s = table_scene(write_fits(folder, "field.fits", planes), 101);
    const auto width2_at = [&](double column) {
        s.stars.clear();
        add_star(s, column - 50, 0);
        return moments(render(renderer::Renderer(s, {}))).width2;
    };
    CHECK_THAT(width2_at(12), WithinRel(0.88 * 0.36 + 0.12 * 2.25 + 1.0 / 12, 0.01));
    CHECK_THAT(width2_at(50), WithinRel((0.36 + 2.25) / 2 + 1.0 / 12, 0.01));
    CHECK_THAT(width2_at(88), WithinRel(0.12 * 0.36 + 0.88 * 2.25 + 1.0 / 12, 0.01));
    // Bands of their own, in one file.
    for (Plane& p : planes)
        p.band = p.x == 0 ? 1 : 2, p.x = 0;
    s.camera.psf.file = write_fits(folder, "bands.fits", planes);
    s.bands = {{400e-9, 500e-9}, {500e-9, 600e-9}};
    s.stars.clear();
    add_star(s, 0, 0);
    const std::vector<float> frame = render_window(renderer::Renderer(s, {}), {0, 0, 101, 101});
    for (std::size_t band = 0; band < 2; ++band) {
        Image image{101,
                    101,
                    {frame.begin() + static_cast<std::ptrdiff_t>(band * 101 * 101),
                     frame.begin() + static_cast<std::ptrdiff_t>((band + 1) * 101 * 101)}};
        CHECK_THAT(moments(image).width2, WithinRel((band == 0 ? 0.36 : 2.25) + 1.0 / 12, 0.01));
    }
}

TEST_CASE("A table of one sample is a point: it smears nothing") {
    const TempFolder folder;
    for (const double oversampling : {1.0, 0.2, 8.0}) {
        const Plane one{1, {0.3}, oversampling};
        scene::Scene s = table_scene(write_fits(folder, fmt::format("{}.fits", oversampling), {one}), 32);
        s.camera.psf.wings_px = oversampling == 8 ? 20 : 0;
        // Half a pixel is from its middle to its edge: column 15.5 + 0.9, row 15.5 - 0.1.
        add_star(s, 0.9, -0.1);
        const Image seen = render(renderer::Renderer(s, {}));
        CHECK_THAT(static_cast<double>(seen.at(16, 15)), WithinRel(star_light(s), 1e-6));
        CHECK_THAT(moments(seen).sum, WithinRel(static_cast<double>(seen.at(16, 15)), 1e-9));
        // A limb is that of pixels without a PSF, bit for bit.
        scene::Scene ball = sphere_scene(renderer::LambertParameters{0}, 0.5, 10, 32);
        ball.camera.psf = s.camera.psf;
        const Image table = render(renderer::Renderer(ball, {16, 2, 1}));
        ball.camera.psf = {};
        ball.camera.psf_sigma_px = 0;
        CHECK(table.values == render(renderer::Renderer(ball, {16, 2, 1})).values);
    }
}

TEST_CASE("A table of one sample along an axis is a line: it spreads along the other only") {
    const TempFolder folder;
    for (const bool upright : {false, true}) {
        Plane line = gaussian(1);
        line.side = 161;
        line.values.clear();
        for (int i = 0; i < line.side; ++i)
            line.values.push_back(std::exp(-std::pow((i - 80) / 8.0, 2) / 2));
        (upright ? line.width : line.height) = 1;
        scene::Scene s = table_scene(write_fits(folder, upright ? "up.fits" : "across.fits", {line}), 33);
        add_star(s, 0, 0);
        const Image seen = render(renderer::Renderer(s, {}));
        double within = 0, spread = 0;
        for (int i = 0; i < 33; ++i) {
            const auto v = static_cast<double>(upright ? seen.at(16, i) : seen.at(i, 16));
            within += v;
            spread += v * (i - 16) * (i - 16);
        }
        CHECK_THAT(within, WithinRel(star_light(s), 1e-5));
        CHECK_THAT(moments(seen).sum, WithinRel(star_light(s), 1e-5));
        CHECK_THAT(spread / within, WithinRel(1 + 1.0 / 12, 0.01));
    }
}

TEST_CASE("Out of focus a star becomes the aperture: a disc, or a ring") {
    const renderer::Aperture aperture{8, 0, 5e-6};
    // In focus the diffraction integral is the Airy pattern.
    for (const double r : {0.0, 0.4, 1.1, 3.0})
        CHECK_THAT(renderer::defocused_psf(aperture, 550e-9, 1e-12, r),
                   WithinAbs(renderer::airy_psf(aperture, 550e-9, r), 1e-6));
    // On the axis: sinc^2 of a quarter of u (Born and Wolf, 8.8.2, eq. 24).
    const double defocus = 200e-6;
    const double u4 = pi * defocus / (8 * 550e-9 * 64);
    CHECK_THAT(renderer::defocused_psf(aperture, 550e-9, defocus, 0) /
                   renderer::airy_psf(aperture, 550e-9, 0),
               WithinRel(std::sin(u4) * std::sin(u4) / (u4 * u4), 1e-4));
    // Far out of focus, with many colours, a disc of radius defocus / 2N: its second moment is r^2 / 4.
    for (const auto model : {scene::PointSpread::Model::airy, scene::PointSpread::Model::gaussian}) {
        scene::Scene s = airy_scene(1, 0, 64);
        s.camera.pixel_pitch_m = 10e-6;
        s.bands = {{450e-9, 650e-9}};
        s.camera.psf.model = model;
        s.camera.psf_sigma_px = 0.3;
        s.camera.psf.defocus_m = 1.6e-3; // a radius of 100 um, 10 px
        add_star(s, 0, 0);
        const Image image = render(renderer::Renderer(s, {}));
        const Moments m = moments(image);
        CHECK_THAT(m.sum, WithinRel(star_light(s), 1e-3));
        const double blur = model == scene::PointSpread::Model::gaussian ? 0.09 : 0;
        CHECK_THAT(m.width2,
                   WithinRel(25 + blur + 1.0 / 12, model == scene::PointSpread::Model::airy ? 0.05 : 0.005));
        s.camera.psf.obscuration = 0.5;
        const Image ring = render(renderer::Renderer(s, {}));
        // Not in the very middle, where waves from a round edge meet.
        CHECK(static_cast<double>(ring.at(31 + 3, 31)) < 0.3 * static_cast<double>(ring.at(31 + 7, 31)));
    }
}

TEST_CASE("Point spread functions that cannot be are refused") {
    const TempFolder folder;
    scene::Scene s = table_scene((folder.path() / "absent.fits").string(), 32);
    CHECK_THROWS_AS(renderer::Renderer(s, {}), InputError);
    // A gzip file is refused: CFITSIO would decompress it, however large that is.
    const std::string plain = write_fits(folder, "plain.fits", {gaussian(1)});
    s.camera.psf.file = plain;
    CHECK_NOTHROW(renderer::Renderer(s, {}));
    REQUIRE(std::system(("gzip -k " + plain + " && mv " + plain + ".gz " + plain + ".fits").c_str()) == 0);
    s.camera.psf.file = plain + ".fits";
    CHECK_THROWS_AS(renderer::Renderer(s, {}), InputError);
    Plane dark = gaussian(1);
    std::fill(dark.values.begin(), dark.values.end(), 0.0);
    s.camera.psf.file = write_fits(folder, "dark.fits", {dark});
    CHECK_THROWS_AS(renderer::Renderer(s, {}), InputError);
    Plane negative = gaussian(1);
    negative.values[7] = -1;
    s.camera.psf.file = write_fits(folder, "negative.fits", {negative});
    CHECK_THROWS_AS(renderer::Renderer(s, {}), InputError);
    // Three corners of four.
    std::vector<Plane> corners(3, gaussian(1));
    corners[1].x = 10;
    corners[2].y = 10;
    s.camera.psf.file = write_fits(folder, "corners.fits", corners);
    CHECK_THROWS_AS(renderer::Renderer(s, {}), InputError);
    s = airy_scene(2, 0, 32);
    s.camera.psf.defocus_m = 1;
    CHECK_THROWS_AS(renderer::Renderer(s, {}), ConfigError);
    s = airy_scene(2, 1, 32);
    CHECK_THROWS_AS(renderer::Renderer(s, {}), ConfigError);
}

} // namespace psf_test
