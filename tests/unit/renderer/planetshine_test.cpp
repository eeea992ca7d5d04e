// SPDX-License-Identifier: Apache-2.0
// Planetshine against quadrature over the bodies that send it: mean, noise, shadows, determinism.
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

namespace planetshine_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double deg = pi / 180;

renderer::EllipsoidParameters sphere(double radius_m) {
    return {{radius_m, radius_m, radius_m}};
}

double radius_of(const scene::Body& body) {
    return body.shape.get<renderer::EllipsoidParameters>().radii_m.x;
}

Vec3 centre_of(const scene::Body& body) {
    return body.motion.samples[0].pose.position_m;
}

double reflectance(const scene::Material& description, double cos_in, double cos_out, double cos_phase) {
    renderer::ScatterPacket s;
    for (int i = 0; i < renderer::packet_size; ++i) {
        s.cos_in[i] = cos_in;
        s.cos_out[i] = cos_out;
        s.cos_phase[i] = cos_phase;
    }
    renderer::Doubles r;
    renderer::make_material(description, "test")->reflectance(s, r);
    return r[0];
}

/// Whether a segment meets a sphere other than those of bodies `a` and `b`.
bool blocked(const scene::Scene& s, Vec3 from, Vec3 to, std::size_t a, std::size_t b) {
    for (std::size_t k = 0; k < s.bodies.size(); ++k) {
        if (k == a || k == b) continue;
        const Vec3 way = to - from;
        const double along =
            std::clamp(dot(centre_of(s.bodies[k]) - from, way) / length_squared(way), 0.0, 1.0);
        if (length(from + way * along - centre_of(s.bodies[k])) < radius_of(s.bodies[k])) return true;
    }
    return false;
}

/// Radiance that body 0, a ball at the origin, sends along its normal `n` by light that the other balls
/// reflect once, per irradiance of the Sun at 1 au: sum over points of their surfaces. The Sun is a point.
double planetshine(const scene::Scene& s, Vec3 n) {
    const Vec3 at = n * radius_of(s.bodies[0]);
    double sum = 0;
    for (std::size_t k = 1; k < s.bodies.size(); ++k) {
        const scene::Body& ball = s.bodies[k];
        const auto material = renderer::make_material(ball.material, "test");
        const auto receiver = renderer::make_material(s.bodies[0].material, "test");
        const Vec3 centre = centre_of(ball);
        const double radius = radius_of(ball);
        const double d = length(centre - at);
        const Vec3 axis = (at - centre) / d;
        Vec3 a;
        Vec3 b;
        orthonormal_basis(axis, a, b);
        // The cap that faces the point: from the cosine R/d to 1.
        constexpr int rings = 512;
        constexpr int steps = 1024;
        for (int i = 0; i < rings; ++i) {
            const double z = radius / d + (1 - radius / d) * (i + 0.5) / rings;
            const double r = std::sqrt(1 - z * z);
            for (int j = 0; j < steps; j += renderer::packet_size) {
                renderer::ScatterPacket sent;
                renderer::ScatterPacket received;
                double weight[renderer::packet_size];
                for (int lane = 0; lane < renderer::packet_size; ++lane) {
                    const double turn = 2 * pi * (j + lane + 0.5) / steps;
                    const Vec3 normal = axis * z + (a * std::cos(turn) + b * std::sin(turn)) * r;
                    const Vec3 point = centre + normal * radius;
                    const Vec3 to_sun = normalized(s.sun.position_m - point);
                    const Vec3 way = at - point;
                    const double distance = length(way);
                    const Vec3 to = way / distance;
                    const double area = 2 * pi * radius * radius * (1 - radius / d) / (rings * steps);
                    const double suns =
                        astronomical_unit_m * astronomical_unit_m / length_squared(s.sun.position_m - point);
                    sent.cos_in[lane] = dot(normal, to_sun);
                    sent.cos_out[lane] = std::max(dot(normal, to), 1e-6);
                    sent.cos_phase[lane] = dot(to_sun, to);
                    received.cos_in[lane] = received.cos_phase[lane] = -dot(n, to);
                    received.cos_out[lane] = 1;
                    const bool seen = sent.cos_in[lane] > 0 && received.cos_in[lane] > 0 &&
                                      !blocked(s, point, s.sun.position_m, k, k) &&
                                      !blocked(s, point, at, 0, k);
                    weight[lane] = seen ? area * dot(normal, to) / (distance * distance) * suns : 0;
                }
                renderer::Doubles first;
                renderer::Doubles second;
                material->reflectance(sent, first);
                receiver->reflectance(received, second);
                for (int lane = 0; lane < renderer::packet_size; ++lane)
                    if (weight[lane] > 0) sum += weight[lane] * first[lane] * second[lane];
            }
        }
    }
    return sum;
}

/// A ball of 1800 km at the origin, the Sun, a point, along -x, and another ball in the direction `beta` from
/// +x: seen from there at phase angle `beta`. The camera looks down on the point of the night side whose
/// normal is half as far from +x.
struct Night {
    scene::Scene scene;
    Vec3 normal;
};

Night night(double beta, double distance_m, double radius_m, scene::Material receiver,
            scene::Material sender) {
    Night n;
    scene::Scene& s = n.scene;
    s.quantity = scene::Quantity::radiance;
    s.sun.position_m = {-astronomical_unit_m, 0, 0};
    s.sun.radius_m = 1000;
    s.bodies.push_back({"receiver", sphere(1.8e6), std::move(receiver), {}});
    s.bodies.push_back({"sender", sphere(radius_m), std::move(sender), {}});
    s.bodies[1].motion.samples[0].pose.position_m =
        distance_m * Vec3{std::cos(beta), std::sin(beta) * 0.8, std::sin(beta) * 0.6};
    n.normal = Vec3{std::cos(beta / 2), std::sin(beta / 2) * 0.8, std::sin(beta / 2) * 0.6};
    s.camera = camera_at(n.normal * 5e6, 16, 1e-5);
    s.camera.psf_sigma_px = 0;
    return n;
}

struct Statistics {
    double mean, noise; ///< noise: standard deviation of single pixels over the mean
};

Statistics statistics(const scene::Scene& s, std::uint32_t samples, std::uint32_t bounces = 1) {
    renderer::RenderSettings settings{samples, 2, 5};
    settings.max_bounces = bounces;
    const Image image = render(renderer::Renderer(s, settings));
    const double count = static_cast<double>(image.values.size());
    const double mean = image.sum() / count;
    double square = 0;
    for (const float v : image.values)
        square += (static_cast<double>(v) - mean) * (static_cast<double>(v) - mean);
    return {mean / sun(s), std::sqrt(square / count) / mean};
}

} // namespace

TEST_CASE("A planet lights the night side of its moon as quadrature over its disc says") {
    const scene::Material laws[] = {renderer::LambertParameters{0.5},
                                    renderer::LommelSeeligerParameters{0.3}};
    for (const scene::Material& law : laws)
        for (const double phase_deg : {12.0, 60.0, 110.0, 150.0}) {
            // As Jupiter over Io: the disc has an angular radius of 9.6 degrees.
            const Night n = night(phase_deg * deg, 4.2e8, 7e7, law, law);
            INFO("phase " << phase_deg);
            CHECK_THAT(statistics(n.scene, 512).mean / planetshine(n.scene, n.normal), WithinAbs(1, 3e-3));
            // By random directions alone it would be 40 % near full phase, and more at others.
            CHECK(statistics(n.scene, 64).noise < 0.06);
            CHECK(statistics(n.scene, 4, 0).mean == 0);
        }
}

TEST_CASE("Earthshine on the Moon has the irradiance of a Lambert sphere") {
    // Far enough for the closed formula: irradiance 2/3 albedo (R/d)^2 Phi(phase).
    const double beta = 40 * deg;
    const Night n =
        night(beta, 3.844e8, 6.371e6, renderer::LambertParameters{0.12}, renderer::LambertParameters{0.3});
    const double phi = (std::sin(beta) + (pi - beta) * std::cos(beta)) / pi;
    const double ratio = 6.371e6 / 3.844e8;
    const double expected = 0.12 / pi * std::cos(beta / 2) * 2.0 / 3 * 0.3 * ratio * ratio * phi;
    const Statistics got = statistics(n.scene, 64);
    CHECK_THAT(got.mean / expected, WithinAbs(1, 0.02));
    CHECK_THAT(got.mean / planetshine(n.scene, n.normal), WithinAbs(1, 3e-3));
    CHECK(got.noise < 0.04);
}

TEST_CASE("Both ways to find planetshine are weighted to one") {
    // A gloss that reflects a near, large planet: found by the law's own directions and by the disc's.
    renderer::PhongParameters gloss;
    gloss.diffuse = 0.2;
    gloss.specular = 0.6;
    for (const double exponent : {20.0, 400.0})
        for (const double radius_m : {1e6, 5e6}) {
            gloss.exponent = exponent;
            const Night n = night(50 * deg, 1.2e7, radius_m, gloss, renderer::LambertParameters{0.5});
            INFO("exponent " << exponent << ", radius " << radius_m);
            CHECK_THAT(statistics(n.scene, 1024).mean / planetshine(n.scene, n.normal), WithinAbs(1, 5e-3));
        }
}

TEST_CASE("A second moon shades planetshine and adds its own") {
    Night n = night(50 * deg, 4.2e8, 7e7, renderer::LambertParameters{0.5}, renderer::LambertParameters{0.5});
    // Half way, in front of the planet's limb as seen from the first moon.
    n.scene.bodies.push_back({"second", sphere(2e7), renderer::LambertParameters{0.1}, {}});
    n.scene.bodies[2].motion.samples[0].pose.position_m =
        centre_of(n.scene.bodies[1]) * 0.5 + Vec3{1e7, 1.5e7, 0};
    const double alone = planetshine(n.scene, n.normal);
    const Statistics got = statistics(n.scene, 256);
    CHECK_THAT(got.mean / alone, WithinAbs(1, 4e-3));
    // The shadow matters to this test.
    n.scene.bodies.pop_back();
    CHECK(planetshine(n.scene, n.normal) > 1.02 * alone);
}

TEST_CASE("Planetshine on the day side adds to sunlight") {
    Night n = night(50 * deg, 2e7, 8e6, renderer::LambertParameters{0.5}, renderer::LambertParameters{0.5});
    n.scene.sun.position_m = astronomical_unit_m * normalized(Vec3{1, -1.3, -0.6});
    const double sunlight = reflectance(renderer::LambertParameters{0.5},
                                        dot(normalized(n.scene.sun.position_m), n.normal), 1, 0) *
                            astronomical_unit_m * astronomical_unit_m /
                            length_squared(n.scene.sun.position_m - n.normal * 1.8e6);
    const double expected = sunlight + planetshine(n.scene, n.normal);
    CHECK(planetshine(n.scene, n.normal) > 0.01 * sunlight);
    CHECK_THAT(statistics(n.scene, 256).mean / expected, WithinAbs(1, 2e-3));
}

TEST_CASE("Planetshine is the same on one thread and on several, in a frame and in a window") {
    const Night n = night(70 * deg, 4.2e8, 7e7, renderer::LambertParameters{0.5},
                          renderer::LommelSeeligerParameters{0.3});
    renderer::RenderSettings settings{16, 1, 5};
    settings.max_bounces = 2;
    const Image one = render(renderer::Renderer(n.scene, settings));
    settings.threads = 3;
    const renderer::Renderer several(n.scene, settings);
    CHECK(render(several).values == one.values);
    const std::vector<float> window = render_window(several, {3, 5, 9, 6});
    bool same = true;
    for (int y = 0; y < 6; ++y)
        for (int x = 0; x < 9; ++x)
            same = same && window[static_cast<std::size_t>(y * 9 + x)] == one.at(3 + x, 5 + y);
    CHECK(same);
}

} // namespace planetshine_test
