// SPDX-License-Identifier: Apache-2.0
// Flux of thin crescents against phase functions, at any size; the lit part of an ellipsoid's disc.
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/lit_disc.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <fstream>
#include <functional>
#include <random>

using namespace obscura;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using renderer::LitDisc;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double deg = pi / 180;

double lambert_phase(double a) {
    return (std::sin(a) + (pi - a) * std::cos(a)) / pi;
}

double lommel_seeliger_phase(double a) {
    if (a == 0) return 1;
    return a >= pi ? 0 : 1 - std::sin(a / 2) * std::tan(a / 2) * std::log(1 / std::tan(a / 4));
}

/// Mean of a phase function over the Sun's disc, uniformly bright, of angular radius `sun_rad`: each point of
/// it lights a small sphere at its own phase angle.
double with_sun_disc(const std::function<double(double)>& phase, double a, double sun_rad) {
    constexpr int rings = 100;
    constexpr int steps = 100;
    double sum = 0;
    for (int i = 0; i < rings; ++i) {
        // Rings of equal solid angle.
        const double off = std::acos(1 - (1 - std::cos(sun_rad)) * (i + 0.5) / rings);
        for (int k = 0; k < steps; ++k) {
            const double turn = 2 * pi * (k + 0.5) / steps;
            const double cosine = std::cos(a) * std::cos(off) + std::sin(a) * std::sin(off) * std::cos(turn);
            sum += phase(std::acos(std::clamp(cosine, -1.0, 1.0)));
        }
    }
    return sum / (rings * steps);
}

/// A ball of 500 m seen from 1e9 m, `radius_px` pixels in radius.
scene::Scene far_ball(scene::Material material, double phase_rad, double radius_px) {
    const auto size = std::max(32, 2 * static_cast<std::int32_t>(radius_px + 8));
    scene::Scene s = sphere_scene(std::move(material), phase_rad, radius_px, size);
    Vec3& camera_m = s.camera.motion.samples[0].pose.position_m;
    camera_m = camera_m * 1e4;
    s.camera.focal_length_m *= 1e4;
    return s;
}

double flux(const scene::Scene& s, std::uint32_t samples) {
    return render(renderer::Renderer(s, {samples, 2, 7})).sum() / sun(s);
}

} // namespace

TEST_CASE("A sphere of any size keeps to its phase function up to 178 degrees") {
    struct Law {
        scene::Material material;
        double full; ///< flux at zero phase over (R / d)^2
        std::function<double(double)> phase;
    };
    const Law laws[] = {{renderer::LambertParameters{0.3}, 0.2, lambert_phase},
                        {renderer::LommelSeeligerParameters{0.2}, 0.2 / 8, lommel_seeliger_phase}};
    for (const Law& law : laws)
        for (const double phase_deg : {0.0, 30.0, 90.0, 135.0, 150.0, 165.0, 170.0, 175.0, 178.0})
            for (const double radius_px : {0.01, 1.0, 2.99, 3.01, 8.0, 30.0}) {
                const double a = phase_deg * deg;
                const scene::Scene s = far_ball(law.material, a, radius_px);
                const double sun_rad = std::asin(s.sun.radius_m / astronomical_unit_m);
                const double expected =
                    law.full * 500.0 * 500.0 / 1e18 * with_sun_disc(law.phase, a, sun_rad);
                INFO("phase " << phase_deg << ", radius " << radius_px << " px");
                // Pixel samples of larger bodies are independent: their noise falls with their number alone.
                const std::uint32_t samples = radius_px < 5 ? 16 : 128;
                CHECK_THAT(flux(s, samples) / expected, WithinAbs(1, 2e-3));
            }
}

TEST_CASE("A mesh smaller than pixels keeps its flux at high phase") {
    const TempFolder folder;
    const std::string file = (folder.path() / "ball.obj").string();
    {
        const renderer::TriangleMesh ball = renderer::make_icosphere(6);
        std::ofstream out(file);
        out.precision(9);
        for (const auto& v : ball.vertices)
            out << "v " << v.x << ' ' << v.y << ' ' << v.z << '\n';
        for (const auto& t : ball.triangles)
            out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
    }
    for (const double phase_deg : {120.0, 150.0, 165.0}) {
        scene::Scene s = far_ball(renderer::LambertParameters{0.3}, phase_deg * deg, 1.5);
        s.bodies[0].shape = renderer::MeshFileParameters{file, 500, true};
        const double expected = 0.2 * 500.0 * 500.0 / 1e18 * lambert_phase(phase_deg * deg);
        INFO("phase " << phase_deg);
        CHECK_THAT(flux(s, 1) / expected, WithinAbs(1, 0.02));
    }
}

TEST_CASE("The night side of a body smaller than pixels glows as much as its day side") {
    for (const double phase_deg : {20.0, 90.0, 170.0})
        for (const double radius_px : {0.5, 2.9}) {
            scene::Scene s = far_ball(renderer::LambertParameters{0}, phase_deg * deg, radius_px);
            s.bodies[0].emission_w_m2_sr = {2.0};
            INFO("phase " << phase_deg << ", radius " << radius_px << " px");
            CHECK_THAT(render(renderer::Renderer(s, {1, 2, 7})).sum(),
                       WithinRel(2 * pi * 500 * 500 / 1e18, 1e-4));
        }
}

TEST_CASE("The lit disc of an ellipsoid holds all that sees the Sun, with its exact solid angle") {
    std::mt19937_64 random(11);
    std::uniform_real_distribution<double> uniform(0, 1);
    const auto direction = [&] {
        const double z = 2 * uniform(random) - 1;
        const double turn = 2 * pi * uniform(random);
        const double r = std::sqrt(1 - z * z);
        return Vec3{r * std::cos(turn), r * std::sin(turn), z};
    };
    for (int scene = 0; scene < 40; ++scene) {
        const Vec3 radii{1 + uniform(random), 1 + uniform(random), 1 + uniform(random)};
        const renderer::Ellipsoid ellipsoid({radii});
        const double reach = ellipsoid.bounding_radius_m();
        // From near the surface to far; Suns from points to discs larger than the body.
        const Vec3 observer = direction() * (reach * (1.05 + 10 * std::pow(uniform(random), 3)));
        const Vec3 sun = direction() * 1e4;
        const double sun_radius = scene % 3 == 0 ? 1e-3 : 1000 * uniform(random);
        const LitDisc disc(ellipsoid, observer, sun, sun_radius);
        REQUIRE(disc.exact());

        // Solid angles of the whole disc by uniform directions in the bounding cone.
        const double d = length(observer);
        const Vec3 axis = -observer / d;
        Vec3 a;
        Vec3 b;
        orthonormal_basis(axis, a, b);
        const double one_minus_cos = 1 - std::sqrt(1 - reach * reach / (d * d));
        constexpr int count = 40000;
        int hits = 0;
        double parts_sr = 0;
        int outside = 0;
        int missed = 0;
        for (int i = 0; i < count; ++i) {
            const double h = one_minus_cos * uniform(random);
            const double turn = 2 * pi * uniform(random);
            const double r = std::sqrt(h * (2 - h));
            const Vec3 w = axis * (1 - h) + (a * std::cos(turn) + b * std::sin(turn)) * r;
            // Scaled to the unit sphere: nearest point along the ray.
            const auto scaled = [&](Vec3 p) { return Vec3{p.x / radii.x, p.y / radii.y, p.z / radii.z}; };
            const Vec3 o = scaled(observer);
            const Vec3 q = scaled(w);
            const double half_b = dot(o, q);
            const double root2 = half_b * half_b - dot(q, q) * (dot(o, o) - 1);
            const bool lit_part = disc.inverse_pdf_sr(LitDisc::Part::lit, w) > 0;
            const bool dark_part = disc.inverse_pdf_sr(LitDisc::Part::dark, w) > 0;
            if (root2 <= 0) {
                outside += lit_part || dark_part ? 1 : 0;
                continue;
            }
            ++hits;
            missed += lit_part || dark_part ? 0 : 1;
            const Vec3 at = observer + w * ((-half_b - std::sqrt(root2)) / dot(q, q));
            const Vec3 n = normalized(
                Vec3{at.x / (radii.x * radii.x), at.y / (radii.y * radii.y), at.z / (radii.z * radii.z)});
            // The point of the Sun's sphere that is highest above the horizon.
            missed += dot(n, sun + n * sun_radius - at) > 1e-9 * length(sun) && !lit_part ? 1 : 0;
        }
        CHECK(outside == 0);
        CHECK(missed == 0);
        const double disc_sr = 2 * pi * one_minus_cos * hits / count;
        const double error_sr =
            2 * pi * one_minus_cos * std::sqrt(hits / (1.0 * count) * (1 - hits / (1.0 * count)) / count);
        for (const LitDisc::Part part : {LitDisc::Part::lit, LitDisc::Part::dark})
            for (int i = 0; i < 200; ++i)
                for (int k = 0; k < 200; ++k) {
                    Vec3 w;
                    const double sr = disc.sample(part, (i + 0.5) / 200, (k + 0.5) / 200, w);
                    parts_sr += sr / 40000;
                    if (sr > 0 && i % 7 == 3 && k % 5 == 2) {
                        CHECK_THAT(length(w), WithinAbs(1, 1e-12));
                        CHECK_THAT(disc.inverse_pdf_sr(part, w), WithinRel(sr, 1e-5));
                    }
                }
        INFO("scene " << scene);
        CHECK_THAT(parts_sr, WithinAbs(disc_sr, 4.5 * error_sr + 1e-3 * disc_sr));
    }
}

TEST_CASE("Of a shape that is no ellipsoid the lit part is at least the half towards the Sun") {
    const renderer::BoxParameters parameters{{2, 2, 2}};
    renderer::ShapeContext context;
    const auto box = make(parameters, context);
    const LitDisc disc(*box, {0, 0, 100}, {1, 0, -1e6}, 10);
    CHECK(!disc.exact());
    CHECK(disc.lit(normalized(Vec3{0.001, 0, -1})));
    CHECK(!disc.lit(normalized(Vec3{-0.001, 0, -1})));
    CHECK(disc.inverse_pdf_sr(LitDisc::Part::dark, normalized(Vec3{-0.001, 0, -1})) > 0);
}
