// SPDX-License-Identifier: Apache-2.0
// Light of every kind against closed formulas and against a plain double-precision path tracer.
#include "core/error.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/mirror.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/polygons.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <array>
#include <random>

namespace light_transport_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;

scene::Scene dark_scene() {
    scene::Scene s;
    s.sun.irradiance_scale = 0;
    s.camera = camera_at({0, 0, 5}, 32, 0.002);
    s.camera.psf_sigma_px = 0;
    return s;
}

/// A square of half side `a` in the plane z = `z`, facing up or down.
renderer::PolygonsParameters square(double a, double z, bool up) {
    renderer::PolygonsParameters p;
    p.faces_m = {{{-a, -a, z}, {a, -a, z}, {a, a, z}, {-a, a, z}}};
    if (!up) std::reverse(p.faces_m[0].begin(), p.faces_m[0].end());
    return p;
}

/// Mean radiance over the central 8 x 8 pixels of band `band`.
double central_radiance(const renderer::Renderer& r, std::size_t band = 0) {
    const scene::Camera& c = r.scene().camera;
    const std::vector<float> image = render_window(r, {0, 0, c.width, c.height});
    const double scale = c.pixel_pitch_m / c.focal_length_m;
    double sum = 0;
    for (int y = c.height / 2 - 4; y < c.height / 2 + 4; ++y)
        for (int x = c.width / 2 - 4; x < c.width / 2 + 4; ++x) {
            const double u = (x - (c.width - 1) / 2.0) * scale;
            const double v = (y - (c.height - 1) / 2.0) * scale;
            sum += static_cast<double>(
                       image[(band * static_cast<std::size_t>(c.height) + static_cast<std::size_t>(y)) *
                                 static_cast<std::size_t>(c.width) +
                             static_cast<std::size_t>(x)]) /
                   (scale * scale) * std::pow(1 + u * u + v * v, 1.5);
        }
    return sum / 64;
}

renderer::RenderSettings settings(std::uint32_t samples, std::uint32_t bounces) {
    renderer::RenderSettings s{samples, 2, 3};
    s.max_bounces = bounces;
    return s;
}

} // namespace

TEST_CASE("Without bounces the path tracer is the fast path") {
    scene::Scene s = sphere_scene(renderer::LommelSeeligerParameters{0.2}, 1.0, 40, 128);
    s.bodies[0].shape = renderer::ProceduralBodyParameters{500, {1, 0.8, 0.7}, 3, 4};
    s.bodies.push_back(
        {"moon", renderer::EllipsoidParameters{{40, 30, 50}}, renderer::LambertParameters{0.4}, {}});
    s.bodies[1].motion.samples[0].pose.position_m = {-700, 300, 200};
    const Image fast = render(renderer::Renderer(s, settings(4, 0)));
    s.bodies[0].colour = {1}; // white, but said: the general tracer takes over
    const Image general = render(renderer::Renderer(s, settings(4, 0)));
    double worst = 0;
    for (std::size_t i = 0; i < fast.values.size(); ++i)
        worst = std::max(worst, static_cast<double>(std::abs(fast.values[i] - general.values[i])) /
                                    std::max(1e-30, static_cast<double>(fast.values[i])));
    CHECK(worst < 1e-5);
}

TEST_CASE("Colours and bands multiply") {
    scene::Scene s = sphere_scene(renderer::LambertParameters{0.8}, 0.5, 20, 48);
    s.bands = {{400e-9, 500e-9}, {500e-9, 700e-9}};
    const std::vector<float> white = render_window(renderer::Renderer(s, settings(4, 0)), {0, 0, 48, 48});
    s.bodies[0].colour = {0.25, 0.75};
    const std::vector<float> tinted = render_window(renderer::Renderer(s, settings(4, 0)), {0, 0, 48, 48});
    const std::size_t centre = 24 * 48 + 24;
    CHECK_THAT(tinted[centre], WithinRel(0.25F * white[centre], 1e-5F));
    CHECK_THAT(tinted[48 * 48 + centre], WithinRel(0.75F * white[48 * 48 + centre], 1e-5F));
}

TEST_CASE("A closed room of glowing grey walls is everywhere as bright as Le / (1 - albedo)") {
    scene::Scene s = dark_scene();
    s.camera = camera_at({0.3, -0.2, 0.1}, 8, 0.02);
    s.camera.psf_sigma_px = 0;
    s.bodies.push_back({"room", inward_cube(), renderer::LambertParameters{0.5}, {}});
    s.bodies[0].emission_w_m2_sr = {3.0};
    const renderer::Renderer r(s, settings(2048, 40));
    CHECK_THAT(central_radiance(r), WithinRel(3.0 / (1 - 0.5), 2e-3));
    // Four terms of the series alone when light is followed over three reflections only.
    const renderer::Renderer cut(s, settings(2048, 3));
    CHECK_THAT(central_radiance(cut), WithinRel(3.0 * (1 + 0.5 + 0.25 + 0.125 + 0.0625), 3e-3));
    // Two thirds of the walls glow in a second material: the same, by another mixture of techniques.
    scene::Scene split = s;
    split.bodies.push_back(split.bodies[0]);
    auto& first = split.bodies[0].shape.get<renderer::PolygonsParameters>().faces_m;
    auto& second = split.bodies[1].shape.get<renderer::PolygonsParameters>().faces_m;
    second.assign(first.begin() + 2, first.end());
    first.resize(2);
    CHECK_THAT(central_radiance(renderer::Renderer(split, settings(2048, 40))), WithinRel(6.0, 2e-3));
}

TEST_CASE("A lamp lights by the inverse square and its beam") {
    scene::Scene s = dark_scene();
    s.camera.focal_length_m *= 50; // only the origin
    s.bodies.push_back({"floor", square(20, 0, true), renderer::LambertParameters{0.6}, {}});
    scene::Lamp lamp;
    lamp.name = "lamp";
    lamp.intensity_w_sr = {7};
    for (const double height : {1.0, 3.0}) {
        lamp.motion.samples[0].pose.position_m = {height, 0, height};
        s.lamps = {lamp};
        // 45 degrees at the origin: cos = 1/sqrt 2, distance = height sqrt 2.
        const double expected = 0.6 / pi * 7 / (2 * height * height) / std::sqrt(2.0);
        CHECK_THAT(central_radiance(renderer::Renderer(s, settings(64, 0))), WithinRel(expected, 1e-3));
        // A spot turned to the origin, and one turned past it.
        lamp.motion.samples[0].pose.orientation = look_along({-1, 0, -1}, {0, 1, 0});
        lamp.beam = scene::Lamp::Beam::uniform;
        lamp.half_angle_rad = 0.1;
        s.lamps = {lamp};
        CHECK_THAT(central_radiance(renderer::Renderer(s, settings(64, 0))), WithinRel(expected, 1e-3));
        lamp.motion.samples[0].pose.orientation = look_along({-1, 0.3, -1}, {0, 1, 0});
        s.lamps = {lamp};
        CHECK(central_radiance(renderer::Renderer(s, settings(4, 0))) == 0);
        // Gaussian: at the angle between the axis and the direction to the origin.
        lamp.beam = scene::Lamp::Beam::gaussian;
        s.lamps = {lamp};
        const double angle = std::acos(std::sqrt(2.0) / std::sqrt(2.09));
        CHECK_THAT(central_radiance(renderer::Renderer(s, settings(64, 0))),
                   WithinRel(expected * std::exp(-2 * angle * angle / 0.01), 0.02));
        lamp.beam = scene::Lamp::Beam::point;
        lamp.motion.samples[0].pose.orientation = {};
    }
    // A body between lamp and floor.
    s.lamps[0].motion.samples[0].pose.position_m = {3, 0, 3};
    s.lamps[0].beam = scene::Lamp::Beam::point;
    s.bodies.push_back(
        {"ball", renderer::EllipsoidParameters{{0.3, 0.3, 0.3}}, renderer::LambertParameters{0.5}, {}});
    s.bodies[1].motion.samples[0].pose.position_m = {1.5, 0, 1.5};
    CHECK(central_radiance(renderer::Renderer(s, settings(4, 0))) == 0);
}

TEST_CASE("A square light over a floor: Hottel's configuration factor") {
    scene::Scene s = dark_scene();
    s.camera.focal_length_m *= 20; // only the point below the light's centre
    s.camera.motion.samples[0].pose = {{4, 0, 3}, look_along({-4, 0, -3}, {0, 0, 1})};
    s.bodies.push_back({"floor", square(20, 0, true), renderer::LambertParameters{0.6}, {}});
    s.bodies.push_back({"light", square(0.5, 2, false), renderer::LambertParameters{0}, {}});
    s.bodies[1].emission_w_m2_sr = {10};
    // One corner of a 0.5 x 0.5 rectangle 2 above: a = b = 0.25; four of them (Howell, configuration C-11).
    const double a = 0.25;
    const double corner = 2 * a / std::sqrt(1 + a * a) * std::atan(a / std::sqrt(1 + a * a)) / (2 * pi);
    const double expected = 0.6 * 10 * 4 * corner;
    CHECK_THAT(central_radiance(renderer::Renderer(s, settings(64, 0))), WithinRel(expected, 1e-3));
    // With bounces, part of the same light is found by chance instead; the floor alone adds nothing.
    CHECK_THAT(central_radiance(renderer::Renderer(s, settings(256, 1))), WithinRel(expected, 4e-3));
}

TEST_CASE("A mirror shows what it reflects, where reflections are followed") {
    scene::Scene s = dark_scene();
    // The camera looks down at a mirror tilted by 45 degrees and sees a glowing wall at its side.
    s.bodies.push_back({"mirror", square(1, 0, true), renderer::MirrorParameters{0.8}, {}});
    s.bodies[0].motion.samples[0].pose.orientation = axis_angle({0, 1, 0}, pi / 4);
    s.bodies.push_back({"wall", square(5, 0, true), renderer::LambertParameters{0}, {}});
    s.bodies[1].motion.samples[0].pose = {{10, 0, 0}, axis_angle({0, 1, 0}, -pi / 2)};
    s.bodies[1].emission_w_m2_sr = {2.5};
    CHECK_THAT(central_radiance(renderer::Renderer(s, settings(4, 1))), WithinRel(0.8 * 2.5, 1e-5));
    CHECK(central_radiance(renderer::Renderer(s, settings(4, 0))) == 0);
}

TEST_CASE("Only the outer side glows") {
    scene::Scene s = dark_scene();
    s.bodies.push_back({"panel", square(1, 0, true), renderer::LambertParameters{0.3}, {}});
    s.bodies[0].emission_w_m2_sr = {2};
    CHECK_THAT(central_radiance(renderer::Renderer(s, settings(1, 0))), WithinRel(2.0, 1e-5));
    s.bodies[0].shape = square(1, 0, false);
    CHECK(central_radiance(renderer::Renderer(s, settings(1, 0))) == 0);
}

TEST_CASE("Lights that cannot be are refused") {
    const auto refusal = [](const scene::Scene& s) -> std::string {
        try {
            const renderer::Renderer r(s, settings(1, 0));
        } catch (const Error& e) {
            return e.what();
        }
        return "accepted";
    };
    scene::Scene s = dark_scene();
    s.bodies.push_back({"panel", square(1, 0, true), renderer::LambertParameters{0.3}, {}});
    CHECK(refusal(s) == "accepted");
    s.bodies[0].emission_w_m2_sr = {1, 2};
    CHECK_THAT(refusal(s),
               ContainsSubstring("body 'panel': emission: 2 numbers: one for each of the 1 bands"));
    s.bodies[0].emission_w_m2_sr = {-1};
    CHECK_THAT(refusal(s), ContainsSubstring("body 'panel': emission -1 W m-2 sr-1: allowed 0 to"));
    s.bodies[0].emission_w_m2_sr = {};
    s.bodies[0].shape = renderer::PolygonsParameters{{{{0, 0, 0}, {1, 0, 0}}}};
    CHECK_THAT(refusal(s), ContainsSubstring("body 'panel': face 1 has 2 corners: at least 3"));
    s.bodies.clear();
    s.lamps.push_back({"spot", {}, scene::Lamp::Beam::uniform, -1, {1}});
    CHECK_THAT(refusal(s), ContainsSubstring("lamp 'spot': half angle -1 rad"));
}

namespace {

/// A path tracer of another kind: scalar, doubles, every triangle tried, one light sample a bounce, no
/// weights, no Russian roulette. Lambertian walls of one reflectance each.
struct PlainTracer {
    struct Triangle {
        Vec3 a, b, c, normal;
        double albedo;
        double emission;
    };
    std::vector<Triangle> triangles;
    std::vector<std::size_t> lights;
    double light_area = 0;
    std::mt19937_64 random{7};

    double uniform() { return std::uniform_real_distribution<double>(0, 1)(random); }

    void add(const renderer::PolygonsParameters& p, double albedo, double emission) {
        for (const auto& f : p.faces_m)
            for (std::size_t k = 2; k < f.size(); ++k) {
                const Vec3 n = cross(f[k - 1] - f[0], f[k] - f[0]);
                triangles.push_back({f[0], f[k - 1], f[k], normalized(n), albedo, emission});
                if (emission > 0) {
                    lights.push_back(triangles.size() - 1);
                    light_area += length(n) / 2;
                }
            }
    }

    /// Moeller and Trumbore.
    static double meet(const Triangle& t, Vec3 o, Vec3 d) {
        const Vec3 e1 = t.b - t.a;
        const Vec3 e2 = t.c - t.a;
        const Vec3 p = cross(d, e2);
        const double det = dot(e1, p);
        if (std::abs(det) < 1e-14) return -1;
        const Vec3 s = o - t.a;
        const double u = dot(s, p) / det;
        const Vec3 q = cross(s, e1);
        const double v = dot(d, q) / det;
        if (u < 0 || v < 0 || u + v > 1) return -1;
        return dot(e2, q) / det;
    }

    double radiance(Vec3 o, Vec3 d, int bounces) {
        double sum = 0;
        double carried = 1;
        for (int bounce = 0; bounce <= bounces; ++bounce) {
            double nearest = 1e30;
            const Triangle* hit = nullptr;
            for (const Triangle& t : triangles) {
                const double x = meet(t, o, d);
                if (x > 1e-7 && x < nearest) {
                    nearest = x;
                    hit = &t;
                }
            }
            if (hit == nullptr) break;
            if (bounce == 0 && dot(hit->normal, d) < 0) sum += hit->emission;
            const Vec3 n = dot(hit->normal, d) < 0 ? hit->normal : -hit->normal;
            const Vec3 p = o + d * nearest;
            // All lights here have equal triangles: two halves of a rectangle.
            const Triangle& light =
                triangles[lights[static_cast<std::size_t>(uniform() * static_cast<double>(lights.size()))]];
            const double root = std::sqrt(uniform());
            const double w = uniform();
            const Vec3 at = light.a * (1 - root) + light.b * (root * (1 - w)) + light.c * (root * w);
            const Vec3 to = at - p;
            const double distance = length(to);
            const Vec3 l = to / distance;
            const double cosines = dot(n, l) * -dot(light.normal, l);
            if (dot(n, l) > 0 && cosines > 0) {
                bool blocked = false;
                for (const Triangle& t : triangles) {
                    const double x = meet(t, p, l);
                    if (x > 1e-7 && x < distance - 1e-6) blocked = true;
                }
                if (!blocked)
                    sum += carried * hit->albedo / pi * cosines / (distance * distance) * light_area *
                           light.emission;
            }
            // Cosine-weighted by Malley's method.
            const double radius = std::sqrt(uniform());
            const double angle = 2 * pi * uniform();
            Vec3 a;
            Vec3 b;
            orthonormal_basis(n, a, b);
            d = a * (radius * std::cos(angle)) + b * (radius * std::sin(angle)) +
                n * std::sqrt(1 - radius * radius);
            o = p;
            carried *= hit->albedo;
        }
        return sum;
    }
};

/// The Cornell box in metres: floor, ceiling, back, red, green, light, short and tall block. Geometry:
/// Cornell University Program of Computer Graphics, "Cornell Box Data" (measured 1998).
std::vector<std::pair<renderer::PolygonsParameters, double>> cornell_box() {
    const auto make = [](std::vector<std::vector<Vec3>> faces) {
        for (auto& f : faces)
            for (Vec3& p : f)
                p = p * 1e-3;
        return renderer::PolygonsParameters{std::move(faces)};
    };
    return {
        {make({{{552.8, 0, 0}, {0, 0, 0}, {0, 0, 559.2}, {549.6, 0, 559.2}}}), 0.74},
        {make({{{556, 548.8, 0}, {556, 548.8, 559.2}, {0, 548.8, 559.2}, {0, 548.8, 0}}}), 0.74},
        {make({{{549.6, 0, 559.2}, {0, 0, 559.2}, {0, 548.8, 559.2}, {556, 548.8, 559.2}}}), 0.74},
        {make({{{552.8, 0, 0}, {549.6, 0, 559.2}, {556, 548.8, 559.2}, {556, 548.8, 0}}}), 0.06},
        {make({{{0, 0, 559.2}, {0, 0, 0}, {0, 548.8, 0}, {0, 548.8, 559.2}}}), 0.28},
        {make({{{343, 548.7, 227}, {343, 548.7, 332}, {213, 548.7, 332}, {213, 548.7, 227}}}), 0.78},
        {make({{{130, 165, 65}, {82, 165, 225}, {240, 165, 272}, {290, 165, 114}},
               {{290, 0, 114}, {290, 165, 114}, {240, 165, 272}, {240, 0, 272}},
               {{130, 0, 65}, {130, 165, 65}, {290, 165, 114}, {290, 0, 114}},
               {{82, 0, 225}, {82, 165, 225}, {130, 165, 65}, {130, 0, 65}},
               {{240, 0, 272}, {240, 165, 272}, {82, 165, 225}, {82, 0, 225}}}),
         0.74},
        {make({{{423, 330, 247}, {265, 330, 296}, {314, 330, 456}, {472, 330, 406}},
               {{423, 0, 247}, {423, 330, 247}, {472, 330, 406}, {472, 0, 406}},
               {{472, 0, 406}, {472, 330, 406}, {314, 330, 456}, {314, 0, 456}},
               {{314, 0, 456}, {314, 330, 456}, {265, 330, 296}, {265, 0, 296}},
               {{265, 0, 296}, {265, 330, 296}, {423, 330, 247}, {423, 0, 247}}}),
         0.74},
    };
}

} // namespace

TEST_CASE("The Cornell box agrees with a plain path tracer block by block") {
    constexpr int size = 64;
    constexpr int block = 16;
    scene::Scene s = dark_scene();
    s.camera.width = s.camera.height = size;
    s.camera.focal_length_m = 0.035;
    s.camera.pixel_pitch_m = 0.025 / size;
    s.camera.motion.samples[0].pose = {{0.278, 0.273, -0.8}, look_along({0, 0, 1}, {0, 1, 0})};
    PlainTracer plain;
    const auto walls = cornell_box();
    for (std::size_t i = 0; i < walls.size(); ++i) {
        s.bodies.push_back({"part", walls[i].first, renderer::LambertParameters{walls[i].second}, {}});
        if (i == 5) s.bodies.back().emission_w_m2_sr = {8};
        plain.add(walls[i].first, walls[i].second, i == 5 ? 8 : 0);
    }
    const Image image = render(renderer::Renderer(s, settings(64, 4)));
    const double scale = s.camera.pixel_pitch_m / s.camera.focal_length_m;
    const Pose& pose = s.camera.motion.samples[0].pose;
    for (int by = 0; by < size / block; ++by)
        for (int bx = 0; bx < size / block; ++bx) {
            double ours = 0;
            for (int y = by * block; y < (by + 1) * block; ++y)
                for (int x = bx * block; x < (bx + 1) * block; ++x)
                    ours += static_cast<double>(image.at(x, y));
            double sum = 0;
            double square_sum = 0;
            constexpr int paths = 12'000;
            for (int k = 0; k < paths; ++k) {
                const double u = (bx * block - 0.5 + block * plain.uniform() - (size - 1) / 2.0) * scale;
                const double v = (by * block - 0.5 + block * plain.uniform() - (size - 1) / 2.0) * scale;
                const double solid_angle = scale * scale / std::pow(1 + u * u + v * v, 1.5);
                const double value =
                    plain.radiance(pose.position_m, rotate(pose.orientation, normalized(Vec3{u, v, 1})), 4) *
                    solid_angle * block * block;
                sum += value / paths;
                square_sum += value * value / paths;
            }
            const double deviation = std::sqrt((square_sum - sum * sum) / paths);
            INFO("block " << bx << ' ' << by << " deviation " << deviation / sum);
            // 2 % and the noise of the plain tracer.
            CHECK_THAT(ours / sum, WithinAbs(1, 0.01 + 3.5 * deviation / sum));
        }
}

} // namespace light_transport_test
