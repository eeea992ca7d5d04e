// SPDX-License-Identifier: Apache-2.0
// The overlay of a frame against its truth table and a tangent cone.
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "renderer/truth/overlay.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <random>
#include <string>
#include <vector>

namespace overlay_test {

using namespace obscura;

namespace {

constexpr std::int32_t size = 256;

std::vector<RowTime> rows_at_rest() {
    return std::vector<RowTime>(size, RowTime{Time{-1'000'000}, Time{1'000'000}});
}

FrameWindow whole() {
    FrameWindow window;
    window.sensor = {0, 0, size, size};
    return window;
}

renderer::Overlay overlay_of(const renderer::Renderer& r, std::uint32_t limb_points) {
    const FrameWindow window = whole();
    const std::vector<RowTime> rows = rows_at_rest();
    GroundTruth truth;
    r.fill_truth({}, truth);
    return r.overlay(
        {.windows = {&window, 1}, .rows = rows, .truth = truth, .mid = {}, .limb_points = limb_points});
}

SceneTruth table_of(const renderer::Renderer& r) {
    const FrameWindow window = whole();
    const std::vector<RowTime> rows = rows_at_rest();
    renderer::TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    SceneTruth truth;
    r.list_truth(request, truth);
    return truth;
}

/// A body of radius about 100 m that fills most of the field, and stars about it.
scene::Scene scene_of(const scene::Body& body) {
    scene::Scene s;
    s.camera = test::camera_at({-1000, 200, 300}, size, 1.2e-3);
    s.camera.psf_sigma_px = 0.6;
    s.bodies.push_back(body);
    std::mt19937 random(3);
    std::uniform_real_distribution<double> place(-0.16, 0.16), magnitude(1, 6);
    const Vec3 ahead = normalized(Vec3{1000, -200, -300});
    for (int i = 0; i < 300; ++i) {
        const Vec3 d = normalized(ahead + Vec3{place(random), place(random), place(random)});
        scene::Star star;
        star.right_ascension_rad = std::atan2(d.y, d.x);
        star.declination_rad = std::asin(d.z);
        star.magnitude_v = magnitude(random);
        s.stars.push_back(star);
    }
    return s;
}

} // namespace

TEST_CASE("an overlay has bodies, limb and stars where the truth table has them", "[renderer][truth]") {
    renderer::ProceduralBodyParameters asteroid;
    asteroid.mean_radius_m = 90;
    asteroid.subdivisions = 4;
    renderer::PlanetParameters planet;
    planet.radii_m = {110, 100, 90};
    const std::vector<std::pair<std::string, scene::Shape>> shapes{
        {"ellipsoid", renderer::EllipsoidParameters{{120, 100, 80}}}, {"mesh", asteroid}, {"planet", planet}};
    for (const auto& [name, shape] : shapes) {
        CAPTURE(name);
        const renderer::Renderer r(scene_of({name, shape, renderer::LambertParameters{0.3}, {}}), {1, 2, 1});
        constexpr std::uint32_t points = 72; // of the table
        const renderer::Overlay overlay = overlay_of(r, points + 1);
        const SceneTruth table = table_of(r);
        REQUIRE(overlay.bodies.size() == 1);
        CHECK(overlay.bodies_of == 1);
        const renderer::OverlayBody& body = overlay.bodies[0];
        std::size_t limb = 0, stars = 0;
        for (const TruthEntry& e : table.entries) {
            const auto near = [&e](const renderer::ImagePoint& p) {
                return std::hypot(p.x - e.x_px, p.y - e.y_px) < 1e-6;
            };
            if (e.kind == TruthKind::body && e.object == 0) CHECK(near(body.at.value()));
            if (e.kind == TruthKind::limb) {
                REQUIRE(limb < body.limb.size());
                CHECK(near(body.limb[limb].at));
                CHECK(body.limb[limb].lit == e.lit);
                CHECK(body.limb[limb].begins == (limb == 0));
                ++limb;
            }
            if (e.kind != TruthKind::star || e.visibility != TruthVisibility::visible) continue;
            const auto fainter = [&e](const renderer::OverlayStar& star) {
                return star.magnitude_v > e.magnitude_v;
            };
            const auto same = [&](const renderer::OverlayStar& star) {
                return near(star.at) && star.magnitude_v == e.magnitude_v;
            };
            const bool listed = std::any_of(overlay.stars.begin(), overlay.stars.end(), same);
            CHECK((listed || !std::any_of(overlay.stars.begin(), overlay.stars.end(), fainter)));
            if (listed) ++stars;
        }
        CHECK(limb == points);
        REQUIRE(body.limb.size() == points + 1); // the first one again
        CHECK(std::hypot(body.limb.back().at.x - body.limb[0].at.x,
                         body.limb.back().at.y - body.limb[0].at.y) < 1e-6);
        CHECK(stars == 100);
        CHECK(overlay.stars.size() == 100);
    }
}

TEST_CASE("the limb of a body far larger than the field has its points where the field is",
          "[renderer][truth]") {
    constexpr double radius_m = 1.7e6, altitude_m = 1e5, pixel_rad = 2e-5;
    const Vec3 eye{0, 0, radius_m + altitude_m};
    // Towards the horizon, at some azimuth.
    const double dip = std::asin(radius_m / eye.z);
    const Vec3 ahead{std::sin(dip) * std::cos(2.0), std::sin(dip) * std::sin(2.0), -std::cos(dip)};
    renderer::PlanetParameters planet;
    planet.radii_m = {radius_m, radius_m, radius_m};
    for (const scene::Shape& shape :
         {scene::Shape(renderer::EllipsoidParameters{{radius_m, radius_m, radius_m}}),
          scene::Shape(planet)}) {
        scene::Scene s;
        s.camera = test::camera_at({0, 0, 1}, size, pixel_rad);
        s.camera.motion.samples[0].pose = {eye, look_along(ahead, {0, 0, 1})};
        s.bodies.push_back({"moon", shape, renderer::LambertParameters{0.3}, {}});
        const renderer::Renderer r(s, {1, 2, 1});
        const renderer::Overlay overlay = overlay_of(r, 64);
        const std::vector<renderer::LimbPoint>& limb = overlay.bodies.at(0).limb;
        CAPTURE(limb.size());
        REQUIRE(limb.size() >= 32);
        double worst_px = 0, max_px = 0;
        for (std::size_t i = 0; i < limb.size(); ++i) {
            const double x = limb[i].at.x, y = limb[i].at.y;
            CHECK((x >= -0.5 && y >= -0.5 && x < size - 0.5 && y < size - 0.5));
            const Vec3 d = normalized(
                rotate(s.camera.motion.samples[0].pose.orientation,
                       {(x - (size - 1) / 2.0) * pixel_rad, (y - (size - 1) / 2.0) * pixel_rad, 1}));
            worst_px = std::max(worst_px, std::abs(std::acos(-d.z) - dip) / pixel_rad);
            if (i > 0) max_px = std::max(max_px, std::hypot(x - limb[i - 1].at.x, y - limb[i - 1].at.y));
            CHECK(limb[i].begins == (i == 0));
        }
        CHECK(worst_px < 1e-3);
        CHECK(max_px < 10);
        CHECK(std::hypot(limb.back().at.x - limb[0].at.x, limb.back().at.y - limb[0].at.y) > 200);
    }
}

} // namespace overlay_test
