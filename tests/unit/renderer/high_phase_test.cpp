// SPDX-License-Identifier: Apache-2.0
// Flux of small bodies and thin crescents at any phase and size; the lit part of an ellipsoid's disc.
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/mesh_files/mesh_file.hpp"
#include "renderer/shapes/box.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/lit_disc.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "renderer/shapes/polygons.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <functional>
#include <memory>
#include <random>
#include <string>
#include <utility>

namespace high_phase_test {

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

/// A body of flat facets, far away, and its flux by brute force.
class Rough {
public:
    /// Writes the mesh to `file`.
    explicit Rough(const std::filesystem::path& file,
                   renderer::TriangleMesh mesh = renderer::make_procedural_body({400, {1, 0.8, 0.7}, 3, 4}))
        : file_(file.string()) {
        mesh.normals.clear();
        std::ofstream out(file);
        out.precision(9);
        for (const auto& v : mesh.vertices)
            out << "v " << v.x << ' ' << v.y << ' ' << v.z << '\n';
        for (const auto& t : mesh.triangles)
            out << "f " << t[0] + 1 << ' ' << t[1] + 1 << ' ' << t[2] + 1 << '\n';
        shape_ = std::make_unique<renderer::MeshShape>(std::make_shared<const renderer::EmbreeDevice>(),
                                                       std::move(mesh));
    }
    /// `radius_px`: of the bounding sphere.
    [[nodiscard]] scene::Scene scene(double phase_rad, double radius_px) const {
        const double per_ball = shape_->bounding_radius_m() / 500;
        scene::Scene s = far_ball(renderer::LambertParameters{0.3}, phase_rad, radius_px / per_ball);
        s.bodies[0].shape = renderer::MeshFileParameters{file_, 1, false};
        return s;
    }
    /// Irradiance at the camera over that of the Sun: every facet that faces both has points, each with a
    /// ray to the camera and one to the Sun's disc, in proportion to the light that they may have.
    [[nodiscard]] double flux(double phase_rad) const {
        const Vec3 camera{-std::cos(phase_rad), std::sin(phase_rad), 0};
        const double sun_rad = std::asin(obscura::scene::Sun{}.radius_m / astronomical_unit_m);
        std::mt19937_64 random(5);
        std::uniform_real_distribution<double> uniform(0, 1);
        double most = 0; // light without shadows, in all
        const auto bound = [&](Vec3 area) {
            const double in = dot(area, Vec3{-1, 0, 0}) + length(area) * sun_rad;
            return std::max(0.0, dot(area, camera)) * std::max(0.0, in) / length(area);
        };
        for (std::size_t i = 0; i < shape_->mesh().triangles.size(); ++i)
            most += bound(area(i));
        double sum = 0;
        for (std::size_t i = 0; i < shape_->mesh().triangles.size(); ++i) {
            const Vec3 facet = area(i);
            const double share = bound(facet) / most;
            if (!(share > 0)) continue;
            // A grid of cells in the triangle's two coordinates.
            const int side = std::max(4, static_cast<int>(std::sqrt(2e6 * share)) / 4 * 4);
            double lit = 0;
            for (int k = 0; k < side * side; k += renderer::packet_size) {
                renderer::RayPacket rays;
                renderer::Vec3s to_sun;
                renderer::Doubles cosine;
                for (int lane = 0; lane < renderer::packet_size; ++lane) {
                    const double root = std::sqrt(((k + lane) / side + uniform(random)) / side);
                    const double v = ((k + lane) % side + uniform(random)) / side;
                    const Vec3 a = corner(i, 0);
                    const Vec3 at =
                        a + (corner(i, 1) - a) * (root * (1 - v)) + (corner(i, 2) - a) * (root * v);
                    rays.origin.set(lane, at + facet * (5e-7 * shape_->bounding_radius_m() / length(facet)));
                    rays.direction.set(lane, camera);
                    rays.t_max[lane] = renderer::no_hit;
                    rays.active.on[lane] = -1;
                    // Uniform over the Sun's disc.
                    const double off = sun_rad * std::sqrt(uniform(random));
                    const double turn = 2 * pi * uniform(random);
                    const Vec3 way = normalized(Vec3{-1, off * std::cos(turn), off * std::sin(turn)});
                    to_sun.set(lane, way);
                    cosine[lane] = dot(facet, way) / length(facet);
                }
                shape_->occlude(rays);
                rays.direction = to_sun;
                shape_->occlude(rays);
                for (int lane = 0; lane < renderer::packet_size; ++lane)
                    if (rays.active.on[lane] != 0) lit += std::max(0.0, cosine[lane]);
            }
            sum += dot(facet, camera) * lit / (side * side);
        }
        return 0.3 / pi * sum / 1e18;
    }
    /// Solid angle of its outline, if it is convex.
    [[nodiscard]] double silhouette_sr(double phase_rad) const {
        const Vec3 camera{-std::cos(phase_rad), std::sin(phase_rad), 0};
        double sum = 0;
        for (std::size_t i = 0; i < shape_->mesh().triangles.size(); ++i)
            sum += std::max(0.0, dot(area(i), camera));
        return sum / 1e18;
    }

private:
    [[nodiscard]] Vec3 corner(std::size_t triangle, std::size_t k) const {
        const auto v = shape_->mesh().vertices[shape_->mesh().triangles[triangle][k]];
        return {v.x, v.y, v.z};
    }
    [[nodiscard]] Vec3 area(std::size_t triangle) const {
        return cross(corner(triangle, 1) - corner(triangle, 0), corner(triangle, 2) - corner(triangle, 0)) /
               2;
    }

    std::string file_;
    std::unique_ptr<renderer::MeshShape> shape_;
};

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

TEST_CASE("A rough mesh keeps its flux at high phase, whether it is smaller than pixels or not") {
    const TempFolder folder;
    const Rough rough(folder.path() / "rough.obj");
    for (const double phase_deg : {0.0, 60.0, 120.0, 135.0, 150.0, 165.0, 170.0, 175.0, 178.0}) {
        const double expected = rough.flux(phase_deg * deg);
        // On either side of the size from which pixels are sampled as well.
        for (const double radius_px : {0.01, 2.99, 3.01}) {
            const scene::Scene s = rough.scene(phase_deg * deg, radius_px);
            const renderer::Renderer r(s, {16, 2, 7});
            double mean = 0;
            double square = 0;
            constexpr int frames = 8;
            for (int frame = 0; frame < frames; ++frame) {
                const double error =
                    render(r, static_cast<std::uint64_t>(frame)).sum() / sun(s) / expected - 1;
                mean += error / frames;
                square += error * error / frames;
            }
            INFO("phase " << phase_deg << ", radius " << radius_px << " px: mean " << mean << ", rms "
                          << std::sqrt(square));
            CHECK(std::sqrt(square) < 2e-3);
            CHECK(std::abs(mean) < 2e-3);
        }
    }
}

TEST_CASE("Triangles without area are in no list of lit facets, however many there are") {
    renderer::TriangleMesh mesh = renderer::make_procedural_body({400, {1, 0.8, 0.7}, 3, 4});
    const std::size_t before = mesh.triangles.size();
    const std::size_t points = 20 * before;
    mesh.triangles.insert(mesh.triangles.begin(), points, {0, 0, 1});
    const renderer::MeshShape shape(std::make_shared<const renderer::EmbreeDevice>(), std::move(mesh));
    REQUIRE(shape.facets() != nullptr);
    const auto lit = shape.facets()->lit({1e6, 2e5, 0}, {astronomical_unit_m, 0, 0}, scene::Sun{}.radius_m);
    std::size_t listed = 0;
    for (std::size_t triangle = 0; triangle < points + before; ++triangle)
        if (lit->has(static_cast<std::uint32_t>(triangle))) {
            CHECK(triangle >= points);
            ++listed;
        }
    CHECK(listed == lit->size());
    CHECK(listed > before / 4);
}

TEST_CASE("Flat faces smaller than pixels send what Lambert's law says of each") {
    renderer::PolygonsParameters block;
    const Vec3 half{3, 2, 1};
    for (const double side : {-1.0, 1.0}) {
        const auto face = [&](Vec3 a, Vec3 b, Vec3 out) {
            std::vector<Vec3> corners{out - a - b, out + a - b, out + a + b, out - a + b};
            if (dot(cross(a, b), out) < 0) std::reverse(corners.begin(), corners.end());
            block.faces_m.push_back(corners);
        };
        face({0, half.y, 0}, {0, 0, half.z}, {side * half.x, 0, 0});
        face({half.x, 0, 0}, {0, 0, half.z}, {0, side * half.y, 0});
        face({half.x, 0, 0}, {0, half.y, 0}, {0, 0, side * half.z});
    }
    for (const double phase_deg : {10.0, 100.0, 140.0}) {
        scene::Scene s = far_ball(renderer::LambertParameters{0.3}, phase_deg * deg, 1);
        s.bodies[0].shape = block;
        s.bodies[0].motion.samples[0].pose.orientation = axis_angle(normalized(Vec3{1, 2, 3}), 0.3);
        const Quat to_body = conjugate(s.bodies[0].motion.samples[0].pose.orientation);
        const Vec3 sun_way = rotate(to_body, {-1, 0, 0});
        const Vec3 camera_way = rotate(to_body, normalized(s.camera.motion.samples[0].pose.position_m));
        double expected = 0;
        for (const auto& [out, area] : {std::pair{Vec3{1, 0, 0}, 4 * half.y * half.z},
                                        {Vec3{0, 1, 0}, 4 * half.x * half.z},
                                        {Vec3{0, 0, 1}, 4 * half.x * half.y}})
            for (const double side : {-1.0, 1.0})
                expected += 0.3 / pi * area * std::max(0.0, side * dot(out, sun_way)) *
                            std::max(0.0, side * dot(out, camera_way)) / 1e18;
        INFO("phase " << phase_deg);
        CHECK(expected > 0);
        CHECK_THAT(flux(s, 1) / expected, WithinAbs(1, 2e-3));
    }
}

TEST_CASE("A mesh that glows does so where the Sun shines and where it does not") {
    const TempFolder folder;
    const Rough rough(folder.path() / "rough.obj", renderer::make_icosphere(3));
    for (const double phase_deg : {20.0, 90.0, 170.0})
        for (const double radius_px : {0.5, 2.9, 3.1}) {
            scene::Scene s = rough.scene(phase_deg * deg, radius_px);
            s.bodies[0].material = renderer::LambertParameters{0};
            s.bodies[0].emission_w_m2_sr = {2.0};
            INFO("phase " << phase_deg << ", radius " << radius_px << " px");
            CHECK_THAT(render(renderer::Renderer(s, {4, 2, 7})).sum() /
                           (2 * rough.silhouette_sr(phase_deg * deg)),
                       WithinAbs(1, 5e-3));
        }
}

TEST_CASE("Small meshes and crescents of larger ones leave all their light in core and wings") {
    const TempFolder folder;
    const Rough rough(folder.path() / "rough.obj");
    const double expected = rough.flux(150 * deg);
    double share[2];
    for (const int i : {0, 1}) {
        scene::Scene s = rough.scene(150 * deg, i == 0 ? 2.5 : 9);
        s.camera.width = s.camera.height = 160;
        s.camera.psf.model = scene::PointSpread::Model::airy;
        // The first dark ring at 1.22 pixels.
        s.camera.aperture_m = s.camera.focal_length_m * 550e-9 / s.camera.pixel_pitch_m;
        s.bands = {{545e-9, 555e-9}};
        s.camera.psf.wings_px = 60;
        share[i] = flux(s, 4) / expected;
        CHECK(share[i] > 0.98);
        CHECK(share[i] < 1);
    }
    CHECK_THAT(share[1], WithinRel(share[0], 3e-3));
}

TEST_CASE("Small meshes are the same for any threads, row blocks and windows") {
    const TempFolder folder;
    const Rough rough(folder.path() / "rough.obj");
    for (const double radius_px : {1.0, 2.9, 9.0})
        for (const std::int64_t exposure_ns : {std::int64_t{0}, std::int64_t{400 * ns_per_ms}}) {
            scene::Scene s = rough.scene(165 * deg, radius_px);
            s.camera.width = s.camera.height = 40;
            s.bodies[0].motion.spin_axis = {0, 0, 1};
            s.bodies[0].motion.spin_rate_rad_s = 0.5;
            s.camera.motion.spin_axis = {1, 0, 0};
            s.camera.motion.spin_rate_rad_s = 5 / s.camera.focal_length_m * s.camera.pixel_pitch_m;
            const renderer::Renderer one(s, {2, 1, 7});
            const renderer::Renderer three(s, {2, 3, 7});
            const Region all{0, 0, 40, 40};
            const std::vector<float> whole = render_window(one, all, 40, 1, {}, exposure_ns);
            INFO(radius_px << " px, exposed for " << exposure_ns);
            const bool same = whole == render_window(three, all, 7, 1, {}, exposure_ns) &&
                              whole == render_window(three, all, 1, 1, {}, exposure_ns);
            CHECK(same);
            const Region window{17, 15, 9, 11};
            const std::vector<float> part = render_window(three, window, 4, 1, {}, exposure_ns);
            std::size_t differing = 0;
            for (std::int32_t y = 0; y < window.height; ++y)
                for (std::int32_t x = 0; x < window.width; ++x)
                    differing += part[static_cast<std::size_t>(y * window.width + x)] !=
                                         whole[static_cast<std::size_t>((window.y + y) * 40 + window.x + x)]
                                     ? 1
                                     : 0;
            CHECK(differing == 0);
        }
}

TEST_CASE("With a rolling shutter a small mesh does not depend on how rows are grouped") {
    const TempFolder folder;
    const Rough rough(folder.path() / "rough.obj");
    scene::Scene s = rough.scene(150 * deg, 2);
    s.bodies[0].motion.spin_axis = {0, 0, 1};
    s.bodies[0].motion.spin_rate_rad_s = 0.5;
    const renderer::Renderer r(s, {1, 2, 7});
    std::vector<RowTime> times;
    for (std::int64_t row = 0; row < s.camera.height; ++row)
        times.push_back({Time{row / 2 * ns_per_ms}, Time{row / 2 * ns_per_ms}});
    const auto image = [&](std::int32_t rows_each) {
        std::vector<float> whole;
        for (std::int32_t first = 0; first < s.camera.height; first += rows_each) {
            renderer::RenderRequest request;
            request.window = {0, 0, s.camera.width, s.camera.height};
            request.first_row = first;
            request.rows = std::min(rows_each, s.camera.height - first);
            request.row_times = std::span(times).subspan(static_cast<std::size_t>(first),
                                                         static_cast<std::size_t>(request.rows));
            std::vector<float> rows(static_cast<std::size_t>(request.rows * s.camera.width));
            r.render(request, rows);
            whole.insert(whole.end(), rows.begin(), rows.end());
        }
        return whole;
    };
    const std::vector<float> together = image(s.camera.height);
    for (const std::int32_t rows : {1, 2, 5}) {
        const bool same = image(rows) == together;
        CHECK(same);
    }
    double sum = 0;
    for (const float v : together)
        sum += static_cast<double>(v);
    CHECK_THAT(sum / sun(s) / rough.flux(150 * deg), WithinAbs(1, 0.01));
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

} // namespace high_phase_test
