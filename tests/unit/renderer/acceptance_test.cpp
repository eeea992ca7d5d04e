// SPDX-License-Identifier: Apache-2.0
// What the renderer promises to its users in numbers, each against a closed formula.
#include "renderer/materials/ggx.hpp"
#include "renderer/materials/hapke.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/lunar_lambert.hpp"
#include "renderer/materials/material.hpp"
#include "renderer/materials/minnaert.hpp"
#include "renderer/materials/mirror.hpp"
#include "renderer/materials/oren_nayar.hpp"
#include "renderer/materials/phong.hpp"
#include "renderer/materials/registry.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "renderer/shapes/polygons.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <functional>

namespace acceptance_test {

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double deg = pi / 180;

double lambert_phase(double a) {
    return (std::sin(a) + (pi - a) * std::cos(a)) / pi;
}
double lommel_seeliger_phase(double a) {
    return a == 0 ? 1 : 1 - std::sin(a / 2) * std::tan(a / 2) * std::log(1 / std::tan(a / 4));
}

/// Flux over the Sun's irradiance and (radius / distance)^2, of a ball seen from so far that the distance
/// does not matter.
double far_flux(const scene::Material& material, double phase, double radius_px, std::int32_t size,
                std::uint32_t samples) {
    scene::Scene s = sphere_scene(material, phase, radius_px, size);
    s.camera.motion.samples[0].pose.position_m = s.camera.motion.samples[0].pose.position_m * 1e4;
    s.camera.focal_length_m *= 1e4;
    return render(renderer::Renderer(s, {samples, 2, 7})).sum() / sun(s) * 1e18 / (500.0 * 500.0);
}

/// A room of walls that glow inwards with radiance 1 and reflect nothing.
scene::Body furnace() {
    scene::Body body{"furnace", inward_cube(), renderer::LambertParameters{0}, {}};
    body.emission_w_m2_sr = {1};
    return body;
}

/// Share of uniform light that a law sends towards `cos_out`, by quadrature with the midpoint rule in the
/// squared sine and the azimuth.
double albedo_by_quadrature(const renderer::Material& material, double cos_out) {
    constexpr int steps = 400;
    const double sin_out = std::sqrt(1 - cos_out * cos_out);
    double sum = 0;
    for (int a = 0; a < steps; ++a) {
        const double mu = std::sqrt(1 - (a + 0.5) / steps);
        const double sine = std::sqrt(1 - mu * mu);
        for (int c = 0; c < steps; c += renderer::packet_size) {
            renderer::ScatterPacket p;
            for (int i = 0; i < renderer::packet_size; ++i) {
                p.cos_in[i] = mu;
                p.cos_out[i] = cos_out;
                p.cos_phase[i] = mu * cos_out + sine * sin_out * std::cos(pi * (c + i + 0.5) / steps);
            }
            renderer::Doubles r;
            material.reflectance(p, r);
            for (int i = 0; i < renderer::packet_size; ++i)
                sum += r[i] / mu;
        }
    }
    return sum * pi / steps / steps;
}

} // namespace

TEST_CASE("Spheres of Lambert, Lommel-Seeliger and lunar-Lambert keep to their phase curves within 0.1 %") {
    const renderer::LunarLambertParameters moon{0.12, {1, -0.019, 2.42e-4, -1.46e-6}};
    // Not at 0: the Sun's disc hides it from the lunar law, which is steep there.
    for (const double phase : {10.0, 25.0, 50.0, 75.0, 100.0, 125.0}) {
        INFO("phase " << phase);
        const double a = phase * deg;
        const double lambert = 2.0 / 3 * lambert_phase(a);
        CHECK_THAT(far_flux(renderer::LambertParameters{0.3}, a, 100, 256, 32),
                   WithinRel(0.3 * lambert, 1e-3));
        CHECK_THAT(far_flux(renderer::LommelSeeligerParameters{0.2}, a, 100, 256, 32),
                   WithinRel(0.2 / 8 * lommel_seeliger_phase(a), 1e-3));
        const double l = std::clamp(1 + phase * (-0.019 + phase * (2.42e-4 - 1.46e-6 * phase)), 0.0, 1.0);
        CHECK_THAT(far_flux(moon, a, 100, 256, 32),
                   WithinRel(0.12 * (l * lommel_seeliger_phase(a) + (1 - l) * lambert), 1e-3));
    }
}

TEST_CASE("The flux of a body does not change from 1e-4 px to 500 px") {
    const double expected = 0.3 * 2 / 3 * lambert_phase(50 * deg);
    for (const double radius_px : {1e-4, 1e-2, 1.0, 2.99, 3.01, 50.0, 500.0}) {
        INFO("radius " << radius_px << " px");
        CHECK_THAT(
            far_flux(renderer::LambertParameters{0.3}, 50 * deg, radius_px, radius_px > 100 ? 1040 : 160, 4),
            WithinRel(expected, 2e-3));
    }
}

TEST_CASE("In a white furnace every law shows its albedo within 0.2 %") {
    const std::vector<std::pair<std::string, scene::Material>> laws{
        {"lambert", renderer::LambertParameters{0.7}},
        {"lommel-seeliger", renderer::LommelSeeligerParameters{0.3}},
        {"lunar-lambert", renderer::LunarLambertParameters{0.12, {1, -0.019, 2.42e-4, -1.46e-6}}},
        {"minnaert", renderer::MinnaertParameters{0.5, 0.8}},
        {"oren-nayar", renderer::OrenNayarParameters{0.8, 0.5}},
        {"phong", renderer::PhongParameters{0.3, 0.5, 20}},
        {"hapke", renderer::HapkeParameters{0.4, 0.3, 0.6, 1.2, 0.05, 0.4, 0.08, 25 * deg, 0.3}},
        {"ggx metal", renderer::GgxParameters{0.4, 0.9, 0}},
        {"ggx dielectric", renderer::GgxParameters{0.3, 0.04, 0.6}},
        {"mirror", renderer::MirrorParameters{0.8}},
    };
    for (const auto& [name, law] : laws) {
        INFO(name);
        scene::Scene s;
        s.sun.irradiance_scale = 0;
        s.bodies.push_back(furnace());
        // A plate across the room, seen at 40 degrees to its normal.
        renderer::PolygonsParameters plate;
        plate.faces_m = {{{-0.9, -0.9, -0.5}, {0.9, -0.9, -0.5}, {0.9, 0.9, -0.5}, {-0.9, 0.9, -0.5}}};
        s.bodies.push_back({"plate", plate, law, {}});
        const Vec3 eye{std::sin(40 * deg), 0, std::cos(40 * deg) - 0.5};
        s.camera.width = s.camera.height = 8;
        s.camera.pixel_pitch_m = 10e-6;
        s.camera.focal_length_m = 1; // hardly a field at all
        s.camera.psf_sigma_px = 0;
        s.camera.motion.samples[0].pose = {0.9 * eye, look_along(Vec3{0, 0, -0.5} - 0.9 * eye, {0, 1, 0})};
        s.quantity = scene::Quantity::radiance;
        renderer::RenderSettings settings{2048, 2, 3};
        settings.max_bounces = 1;
        const Vec3 to_eye = normalized(0.9 * eye - Vec3{0, 0, -0.5});
        const bool mirror = name == "mirror";
        // A far wall hides behind the plate; the walls below it light nothing that is seen.
        const double expected =
            mirror ? 0.8 : albedo_by_quadrature(*renderer::make_material(law, "test"), to_eye.z);
        CHECK_THAT(render(renderer::Renderer(s, settings)).sum() / 64, WithinRel(expected, 2e-3));
    }
}

TEST_CASE("The limb of a ball lies within 0.01 px of the cone that touches it") {
    scene::Scene s;
    s.sun.irradiance_scale = 0;
    s.quantity = scene::Quantity::radiance;
    s.bodies.push_back(
        {"ball", renderer::EllipsoidParameters{{500, 500, 500}}, renderer::LambertParameters{0}, {}});
    s.bodies[0].emission_w_m2_sr = {1};
    s.camera.width = s.camera.height = 160;
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.focal_length_m = 2e-3; // 5 mrad a pixel
    s.camera.psf_sigma_px = 0;
    s.camera.motion.samples[0].pose = {{0, 0, 0}, {1, 0, 0, 0}};
    const Vec3 centre{300, -150, 3000}; // off the axis: the outline is an ellipse
    s.bodies[0].motion.samples[0].pose.position_m = centre;
    const renderer::Renderer r(s, {4096, 2, 5});
    const Vec3 axis = normalized(centre);
    const double sine = 500 / length(centre);
    const double scale = 10e-6 / 2e-3;
    double worst = 0;
    int rows = 0;
    for (const int row : {30, 47, 52, 60, 71, 83}) {
        const std::vector<float> line = render_window(r, {0, row, 160, 1});
        // Where (axis . d)^2 = cos^2 |d|^2 along the row, as the mean over the row's height.
        double left = 0;
        double right = 0;
        constexpr int parts = 64;
        for (int k = 0; k < parts; ++k) {
            const double v = (row + (k + 0.5) / parts - 0.5 - 79.5) * scale;
            const double c2 = 1 - sine * sine;
            const double b = axis.y * v + axis.z;
            const double qa = axis.x * axis.x - c2;
            const double qb = 2 * axis.x * b;
            const double qc = b * b - c2 * (v * v + 1);
            const double root = std::sqrt(qb * qb - 4 * qa * qc);
            left += (-qb + root) / (2 * qa) / parts;
            right += (-qb - root) / (2 * qa) / parts;
        }
        const double middle = (left + right) / 2 / scale + 79.5;
        const auto split = static_cast<int>(std::lround(middle));
        double before = 0;
        double after = 0;
        for (int x = 0; x < 160; ++x)
            (x < split ? before : after) += static_cast<double>(line[static_cast<std::size_t>(x)]);
        worst = std::max({worst, std::abs(split - 0.5 - before - (left / scale + 79.5)),
                          std::abs(split - 0.5 + after - (right / scale + 79.5))});
        ++rows;
    }
    CHECK(rows == 6);
    CHECK(worst < 0.01);
}

namespace {

/// The largest errors of hits on a mesh, against the same triangles in double precision, from an altitude
/// above its ground: across the ray, in pixels of 60 degrees over 1024, and along it.
struct HitErrors {
    double lateral_px = 0, range_m = 0;
    int hits = 0;
};
HitErrors hit_errors(const renderer::MeshShape& shape, double altitude_m) {
    const double pixel_rad = 60 * deg / 1024;
    const double start_m = 4 * shape.bounding_radius_m();
    const double spread = std::min(2e-3, 50 / altitude_m);
    HitErrors errors;
    for (int n = 0; n < 400; ++n) {
        const double z = 1 - 2 * (n + 0.5) / 400;
        const double turn = 2.399963 * n;
        const Vec3 up{std::sqrt(1 - z * z) * std::cos(turn), std::sqrt(1 - z * z) * std::sin(turn), z};
        // Down to the ground first, then up to the altitude.
        renderer::RayPacket rays;
        renderer::HitPacket hits;
        const auto shoot = [&](Vec3 origin) {
            for (int i = 0; i < renderer::packet_size; ++i) {
                rays.origin.set(i, origin);
                rays.direction.set(
                    i, normalized(-1.0 * up + spread * Vec3{std::cos(1.0 * i), std::sin(2.0 * i), 0.3}));
                rays.t_max[i] = renderer::no_hit;
                rays.active.on[i] = -1;
            }
            hits.clear();
            shape.intersect(rays, 0, hits);
        };
        shoot(start_m * up);
        REQUIRE(hits.body[0] == 0);
        const Vec3 eye = (start_m - hits.t[0] + altitude_m) * up;
        shoot(eye);
        renderer::SurfacePacket surface;
        shape.surface(rays, hits, 0, surface);
        for (int i = 0; i < renderer::packet_size; ++i) {
            if (hits.body[i] < 0) continue;
            ++errors.hits;
            const auto& t = shape.mesh().triangles[hits.primitive[i]];
            const auto corner = [&](std::size_t k) {
                const renderer::Vec3f p = shape.mesh().vertices[t[k]];
                return Vec3{p.x, p.y, p.z};
            };
            const Vec3 a = corner(0);
            const Vec3 normal = cross(corner(1) - a, corner(2) - a);
            const Vec3 d = rays.direction.lane(i);
            if (std::abs(dot(d, normalized(normal))) < 0.3) continue; // the height is what grazing magnifies
            const double exact = dot(a - eye, normal) / dot(d, normal);
            const Vec3 off = surface.position.lane(i) - (eye + exact * d);
            errors.lateral_px =
                std::max(errors.lateral_px, length(off - dot(off, d) * d) / exact / pixel_rad);
            errors.range_m = std::max(errors.range_m, std::abs(hits.t[i] - exact));
        }
    }
    return errors;
}

} // namespace

TEST_CASE("A mesh in floats is as sharp as doubles down to metres from an asteroid, and from the Moon") {
    // The table: camera-relative floats have 9e-5 px at any altitude; floats about the Moon's centre, which
    // is what Embree is given here, 0.001 px at 100 km, 0.07 px at 1 km, 0.9 px at 100 m and 9.9 px at 10 m.
    // The second look in double precision is what makes the difference.
    const auto device = std::make_shared<const renderer::EmbreeDevice>();
    const renderer::MeshShape asteroid(device, renderer::make_procedural_body({500, {1, 0.9, 0.8}, 1, 5}));
    renderer::TriangleMesh ball = renderer::make_icosphere(6);
    for (renderer::Vec3f& p : ball.vertices)
        p = {1737400 * p.x, 1737400 * p.y, 1737400 * p.z};
    const renderer::MeshShape moon(device, std::move(ball));
    for (const double altitude_m : {1e6, 1e5, 1e4, 1e3, 100.0, 10.0}) {
        INFO("altitude " << altitude_m);
        // A float resolves 3e-5 m at 500 m, 0.1 m at the Moon's radius.
        const HitErrors near = hit_errors(asteroid, altitude_m);
        CHECK(near.hits > 6000);
        CHECK(near.lateral_px < 9e-5);
        CHECK(near.range_m < 5e-4);
        const HitErrors far = hit_errors(moon, altitude_m);
        CHECK(far.hits > 6000);
        CHECK(far.lateral_px < 9e-5);
        CHECK(far.range_m < 1);
    }
}

} // namespace acceptance_test
