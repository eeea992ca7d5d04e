// SPDX-License-Identifier: Apache-2.0
// Lenses: each projection and distortion against its formula written from the angles, there and back, and in
// pictures.
#include "core/error.hpp"
#include "renderer/camera/lens.hpp"
#include "renderer/camera/pinhole.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <functional>

namespace lens_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;

scene::Camera camera_with(scene::Projection projection, double focal_px) {
    scene::Camera c;
    c.width = 400;
    c.height = 300;
    c.pixel_pitch_m = 10e-6;
    c.focal_length_m = focal_px * 10e-6;
    c.projection = projection;
    return c;
}

/// The direction that a lens sees at an image point, and what it is worth there.
struct Seen {
    Vec3 direction;
    double weight_sr;
};
Seen look(const renderer::Projection& lens, double x, double y) {
    Doubles xs;
    Doubles ys;
    for (int i = 0; i < packet_size; ++i) {
        xs[i] = i == 5 ? x : 0;
        ys[i] = i == 5 ? y : 0;
    }
    Vec3s d;
    Doubles weight;
    lens.rays(xs, ys, d, weight);
    return {d.lane(5), weight[5]};
}

/// There and back over the sensor, and solid angles against the triangles that three near directions span.
void check_consistent(const renderer::Projection& lens, const scene::Camera& c) {
    double worst_px = 0;
    double worst_area = 0;
    int seen = 0;
    for (double x = -0.4; x < c.width - 0.6; x += 23.7)
        for (double y = -0.4; y < c.height - 0.6; y += 19.3) {
            const Seen s = look(lens, x, y);
            if (s.weight_sr == 0) continue;
            ++seen;
            CHECK_THAT(length(s.direction), WithinAbs(1, 1e-12));
            const auto back = lens.project(3.7 * s.direction);
            REQUIRE(back.has_value());
            worst_px = std::max({worst_px, std::abs(back->x - x), std::abs(back->y - y)});
            constexpr double h = 0.05;
            const Vec3 dx = look(lens, x + h, y).direction - look(lens, x - h, y).direction;
            const Vec3 dy = look(lens, x, y + h).direction - look(lens, x, y - h).direction;
            const double area = length(cross(dx, dy)) / (4 * h * h);
            // At the rim of a hemisphere the angle changes within a fraction of a pixel.
            if (s.direction.z > 0.1 || lens.field_angle_rad(0) > 2)
                worst_area = std::max(worst_area, std::abs(lens.solid_angle_sr(x, y) / area - 1));
            const Seen next = look(lens, x + 1, y);
            if (next.weight_sr > 0) CHECK(length(next.direction - s.direction) <= lens.pixel_angle_rad());
        }
    CHECK(seen > 20);
    CHECK(worst_px < 1e-7);
    CHECK(worst_area < 1e-4);
}

} // namespace

TEST_CASE("Every projection puts an angle where its formula says, and sees it there") {
    struct Case {
        scene::Projection projection;
        std::function<double(double)> radius;
    };
    const std::vector<Case> cases{
        {scene::Projection::pinhole, [](double t) { return std::sin(t) / std::cos(t); }},
        {scene::Projection::equidistant, [](double t) { return t; }},
        {scene::Projection::equisolid, [](double t) { return std::sqrt(2 - 2 * std::cos(t)); }},
        {scene::Projection::stereographic, [](double t) { return 2 * std::sin(t) / (1 + std::cos(t)); }},
        {scene::Projection::orthographic, [](double t) { return std::cos(pi / 2 - t); }},
    };
    for (const Case& c : cases) {
        const scene::Camera camera = camera_with(c.projection, 180);
        const Lens lens(camera);
        for (const double t : {0.0, 0.01, 0.3, 0.8}) // up to 46 degrees: within the sensor for all
            for (const double azimuth : {0.0, 0.5, 2.0, -2.5}) {
                const Vec3 d{std::sin(t) * std::cos(azimuth), std::sin(t) * std::sin(azimuth), std::cos(t)};
                const auto at = lens.project(d);
                REQUIRE(at.has_value());
                CHECK_THAT(at->x, WithinAbs(199.5 + 180 * c.radius(t) * std::cos(azimuth), 1e-9));
                CHECK_THAT(at->y, WithinAbs(149.5 + 180 * c.radius(t) * std::sin(azimuth), 1e-9));
                CHECK(length(look(lens, at->x, at->y).direction - d) < 1e-12);
            }
        check_consistent(lens, camera);
    }
    // The general lens without its generalities is the pinhole.
    const scene::Camera plain = camera_with(scene::Projection::pinhole, 500);
    const Seen a = look(Lens(plain), 31, 250);
    const Seen b = look(Pinhole(plain), 31, 250);
    CHECK(length(a.direction - b.direction) < 1e-14);
    CHECK_THAT(a.weight_sr, WithinRel(b.weight_sr, 1e-12));
}

TEST_CASE("A fisheye of more than a half space sees behind itself, and nothing outside its circle") {
    const scene::Camera c = camera_with(scene::Projection::equidistant, 60); // 149.5 px: 143 degrees
    const Lens lens(c);
    const auto behind = lens.project({std::sin(2.2), 0, std::cos(2.2)});
    REQUIRE(behind.has_value());
    CHECK_THAT(behind->x, WithinAbs(199.5 + 132, 1e-9));
    CHECK(look(lens, 0, 149.5).weight_sr == 0); // 199.5 / 60 rad > pi
    CHECK(lens.solid_angle_sr(399, 299) == 0);
    CHECK(lens.field_angle_rad(0) >= pi - 1e-6);
    // All pixels of the whole sphere together.
    scene::Camera whole = camera_with(scene::Projection::equisolid, 70);
    const Lens all(whole);
    double sphere = 0;
    for (int x = 0; x < whole.width; ++x)
        for (int y = 0; y < whole.height; ++y)
            sphere += all.solid_angle_sr(x, y);
    CHECK_THAT(sphere, WithinRel(4 * pi, 2e-3));
}

TEST_CASE("Distortions are those of the literature, there and back") {
    using Model = scene::Distortion::Model;
    scene::Camera c = camera_with(scene::Projection::pinhole, 350);
    c.principal_offset_px = {7.25, -3.5};
    c.sensor_rotation_rad = 0.02;
    SECTION("OpenCV's rational model, tangential and thin prism terms") {
        c.distortion = {Model::opencv,
                        {-0.28, 0.11, 1.2e-3, -8e-4, -0.02, 0.03, 0.01, -0.004, 1e-3, -2e-4, -5e-4, 1e-4},
                        {},
                        {}};
        const Lens lens(c);
        const auto& k = c.distortion.coefficients;
        for (const Vec3 d : {Vec3{0.1, -0.2, 1}, {-0.45, 0.3, 1}, {0.3, 0.25, 1}}) {
            // As the documentation of calib3d writes it.
            const double x = d.x / d.z, y = d.y / d.z, r = std::hypot(x, y);
            const double radial =
                (1 + k[0] * std::pow(r, 2) + k[1] * std::pow(r, 4) + k[4] * std::pow(r, 6)) /
                (1 + k[5] * std::pow(r, 2) + k[6] * std::pow(r, 4) + k[7] * std::pow(r, 6));
            const double xd = x * radial + 2 * k[2] * x * y + k[3] * (r * r + 2 * x * x) + k[8] * r * r +
                              k[9] * std::pow(r, 4);
            const double yd = y * radial + k[2] * (r * r + 2 * y * y) + 2 * k[3] * x * y + k[10] * r * r +
                              k[11] * std::pow(r, 4);
            const auto at = lens.project(d);
            REQUIRE(at.has_value());
            // Back from the turned, shifted sensor.
            const double u = (at->x - 199.5 - 7.25) / 350, v = (at->y - 149.5 + 3.5) / 350;
            CHECK_THAT(std::cos(0.02) * u - std::sin(0.02) * v, WithinAbs(xd, 1e-12));
            CHECK_THAT(std::sin(0.02) * u + std::cos(0.02) * v, WithinAbs(yd, 1e-12));
        }
        check_consistent(lens, c);
    }
    SECTION("Brown and Conrady's way back") {
        c.distortion = {Model::brown_conrady, {0.15, -0.04, 0.01, 6e-4, -3e-4}, {}, {}};
        const Lens lens(c);
        const double u = (350.0 - 199.5 - 7.25) / 350, v = (40.0 - 149.5 + 3.5) / 350;
        const double x = std::cos(0.02) * u - std::sin(0.02) * v;
        const double y = std::sin(0.02) * u + std::cos(0.02) * v;
        const double r = std::hypot(x, y);
        const double dr = 0.15 * std::pow(r, 3) - 0.04 * std::pow(r, 5) + 0.01 * std::pow(r, 7);
        const double ix = x + x / r * dr + 6e-4 * (r * r + 2 * x * x) + 2 * -3e-4 * x * y;
        const double iy = y + y / r * dr + -3e-4 * (r * r + 2 * y * y) + 2 * 6e-4 * x * y;
        const Vec3 d = look(lens, 350, 40).direction;
        CHECK_THAT(d.x / d.z, WithinAbs(ix, 1e-12));
        CHECK_THAT(d.y / d.z, WithinAbs(iy, 1e-12));
        check_consistent(lens, c);
    }
    SECTION("OpenCV's fisheye") {
        c.projection = scene::Projection::equidistant;
        c.distortion = {Model::radial, {-0.02, 0.004, -0.001, 0.0002}, {}, {}};
        c.sensor_rotation_rad = 0;
        const Lens lens(c);
        const double t = 0.55;
        const double expected = 350 * (t - 0.02 * std::pow(t, 3) + 0.004 * std::pow(t, 5) -
                                       0.001 * std::pow(t, 7) + 0.0002 * std::pow(t, 9));
        const auto at = lens.project({0, -std::sin(t), std::cos(t)});
        REQUIRE(at.has_value());
        CHECK_THAT(149.5 - 3.5 - at->y, WithinAbs(expected, 1e-9));
        check_consistent(lens, c);
    }
    SECTION("a table") {
        c.distortion.model = Model::table;
        for (const double mm : {0.0, 0.6, 1.2, 1.8, 2.4, 3.0}) {
            c.distortion.ideal_mm.push_back(mm);
            c.distortion.real_mm.push_back(mm - 0.004 * mm * mm * mm);
        }
        const Lens lens(c);
        // At an entry exactly, between entries as the smooth curve they were taken from.
        for (const double mm : {1.8, 1.47}) {
            const auto at = lens.project({0, mm / 3.5, 1});
            REQUIRE(at.has_value());
            const double shift = std::hypot(at->x - 199.5 - 7.25, at->y - 149.5 + 3.5) * 0.01;
            CHECK_THAT(shift, WithinAbs(mm - 0.004 * mm * mm * mm, mm == 1.8 ? 1e-12 : 4e-4));
        }
        CHECK_FALSE(lens.project({1, 0, 1}).has_value()); // beyond its end
        check_consistent(lens, c);
    }
}

TEST_CASE("Lenses that cannot be are refused") {
    using Model = scene::Distortion::Model;
    const auto refusal = [](const scene::Distortion& d) {
        scene::Camera c = camera_with(scene::Projection::pinhole, 200);
        c.distortion = d;
        try {
            (void)make_projection(c);
        } catch (const ConfigError& e) {
            return std::string(e.what());
        }
        return std::string("accepted");
    };
    CHECK_THAT(refusal({Model::opencv, {-2.0}, {}, {}}),
               ContainsSubstring("camera: distortion: has no inverse at pixel"));
    CHECK_THAT(refusal({Model::radial, {1, 2, 3, 4, 5}, {}, {}}),
               ContainsSubstring("5 coefficients, allowed at most 4"));
    CHECK_THAT(refusal({Model::table, {}, {0, 1, 2}, {0, 1}}), ContainsSubstring("3 ideal and 2 real"));
    CHECK_THAT(refusal({Model::table, {}, {0, 1, 2}, {0, 1, 0.5}}), ContainsSubstring("entry 3"));
    CHECK_THAT(refusal({Model::none, {0.1}, {}, {}}), ContainsSubstring("allowed at most 0"));
    CHECK_THAT(refusal({Model::radial, {}, {0, 1}, {0, 1}}), ContainsSubstring("a table is given"));
}

TEST_CASE("A strong polynomial does not fold stars from outside back into the picture") {
    scene::Camera c = camera_with(scene::Projection::pinhole, 500);
    c.distortion = {scene::Distortion::Model::opencv, {-0.4}, {}, {}};
    const Lens lens(c);
    // r (1 - 0.4 r^2) is 0.1 at r = 0.101, and again at r = 1.53.
    CHECK(lens.project({0.101, 0, 1}).has_value());
    CHECK_FALSE(lens.project({1.53, 0, 1}).has_value());
}

TEST_CASE("Pictures through a lens: bodies, targeted bodies and stars lie where it projects them") {
    scene::Scene s = sphere_scene(renderer::LambertParameters{0.5}, 0.5, 20, 300);
    s.camera.width = 400;
    s.camera.focal_length_m = 300 * s.camera.pixel_pitch_m;
    s.camera.projection = scene::Projection::stereographic;
    s.camera.distortion = {scene::Distortion::Model::radial, {-0.03}, {}, {}};
    s.camera.pupil_cosine = true;
    s.camera.psf_sigma_px = 0.8;
    s.camera.motion.samples[0].pose = {{0, 0, 0}, {1, 0, 0, 0}}; // looks along +z
    s.sun.position_m = {0, 0, -astronomical_unit_m};
    s.bodies.clear();
    const auto ball = [&](Vec3 direction, double radius_m) {
        scene::Body b{"ball",
                      renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}},
                      renderer::LambertParameters{0.5},
                      {}};
        b.name += std::to_string(s.bodies.size());
        b.motion.samples[0].pose.position_m = 1e6 * normalized(direction);
        s.bodies.push_back(b);
    };
    ball({-0.3, 0.1, 1}, 40e3); // 24 px
    ball({0.5, -0.2, 1}, 2e3);  // about 1 px in radius: targeted
    const Vec3 star = normalized(Vec3{0.2, 0.3, 1});
    s.stars.push_back({std::atan2(star.y, star.x), std::asin(star.z), 0, 0.5});
    const Image image = render(Renderer(s, {64, 2, 3}));
    const auto lens = make_projection(s.camera);
    const auto centroid_near = [&](Vec3 direction, int half, double& sum) {
        const auto at = lens->project(direction);
        REQUIRE(at.has_value());
        double x = 0;
        double y = 0;
        sum = 0;
        for (int j = static_cast<int>(at->y) - half; j <= static_cast<int>(at->y) + half + 1; ++j)
            for (int i = static_cast<int>(at->x) - half; i <= static_cast<int>(at->x) + half + 1; ++i) {
                const double v = image.at(i, j);
                sum += v;
                x += v * i;
                y += v * j;
            }
        return std::hypot(x / sum - at->x, y / sum - at->y);
    };
    double sum = 0;
    CHECK(centroid_near(star, 9, sum) < 1e-3);
    CHECK_THAT(sum, WithinRel(star_irradiance_w_m2({0, 0, 0, 0.5}, s.bands[0]) * star.z, 2e-3));
    // Its centre of light lies a little towards the Sun from its own: less than a third of its radius.
    CHECK(centroid_near(s.bodies[1].motion.samples[0].pose.position_m, 9, sum) < 0.2);
    // The small ball's flux, at a phase angle near 0: 2/3 albedo (R/d)^2 E, dimmed by the pupil.
    const Vec3 small = normalized(s.bodies[1].motion.samples[0].pose.position_m);
    const double a = std::acos(small.z);
    const double phase_law = (std::sin(a) + (pi - a) * std::cos(a)) / pi;
    const double d = 2e-3;
    const double ratio = astronomical_unit_m / (astronomical_unit_m + 1e6 * small.z);
    CHECK_THAT(sum, WithinRel(sun(s) * 2.0 / 3 * 0.5 * d * d * phase_law * small.z * ratio * ratio, 0.01));
    // The large one fills the pixels whose directions meet it.
    const Vec3 big = normalized(s.bodies[0].motion.samples[0].pose.position_m);
    int wrong = 0;
    for (int y = 0; y < 300; ++y)
        for (int x = 0; x < 200; ++x) {
            const double angle = std::acos(std::min(1.0, dot(look(*lens, x, y).direction, big)));
            const bool lit = image.at(x, y) > 0;
            if (std::abs(angle - std::asin(0.04)) > 4.5 * lens->pixel_angle_rad() &&
                lit != (angle < std::asin(0.04)))
                ++wrong;
        }
    CHECK(wrong == 0);
}

} // namespace lens_test
