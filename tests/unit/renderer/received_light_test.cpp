// SPDX-License-Identifier: Apache-2.0
// Light received by surfaces against closed formulas: view factors, enclosures, planetshine, force, mirrors.
#include "core/error.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/materials/lommel_seeliger.hpp"
#include "renderer/materials/mirror.hpp"
#include "renderer/received/received_light.hpp"
#include "renderer/received/receivers.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/polygons.hpp"
#include "renderer/shapes/procedural_body.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"

namespace received_light_test {

using namespace obscura;
using namespace obscura::renderer;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;

scene::Scene empty_scene(double sun) {
    scene::Scene s;
    s.camera = test::camera_at({0, 0, 50}, 8, 0.01);
    s.sun.irradiance_scale = sun;
    return s;
}

scene::Body body(const char* name, scene::Shape shape, scene::Material material, Pose pose = {}) {
    scene::Body b{name, std::move(shape), std::move(material), {}};
    b.motion.samples[0].pose = pose;
    return b;
}

/// A unit square from the origin along +x and +y, facing +z.
PolygonsParameters unit_square() {
    PolygonsParameters p;
    p.faces_m = {{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}};
    return p;
}

double incident_w(const BodyReceivedLight& light, LightCause cause) {
    return light.sums.incident_w[static_cast<std::size_t>(cause)];
}

/// Irradiance in the only band at 1 au.
double sun_w_m2(const scene::Scene& s) {
    return sun_irradiance_w_m2(s.bands.at(0));
}

ReceivedLight light_of(scene::Scene s, const ReceivedLightSettings& settings) {
    return ReceivedLightMap(std::move(s), settings).at(0).value();
}

} // namespace

TEST_CASE("view factors of squares are those of the formulas", "[received]") {
    scene::Scene s = empty_scene(0);
    const bool edge = GENERATE(false, true);
    s.bodies = {body("shines", unit_square(), LambertParameters{0.0}),
                body("sees", unit_square(), LambertParameters{0.0})};
    s.bodies[0].emission_w_m2_sr = std::vector<double>(s.bands.size(), 1 / pi); // exitance 1 W/m2
    // Opposed at a distance of 1, or a wall on the edge y = 0, its outer side towards +y.
    s.bodies[1].motion.samples[0].pose =
        edge ? Pose{{1, 0, 0}, axis_angle({0, 0, 1}, pi) * axis_angle({1, 0, 0}, pi / 2)}
             : Pose{{0, 1, 1}, axis_angle({1, 0, 0}, pi)};
    ReceivedLightSettings settings;
    settings.directions = 65536;
    // Two facets take as many rays as a mesh of many.
    CHECK_THAT(incident_w(light_of(s, {}).bodies[1], LightCause::bodies),
               WithinRel(edge ? 0.200044 : 0.199825, 0.02));
    const ReceivedLight light = light_of(s, settings);
    // Howell, A Catalog of Radiation Heat Transfer Configuration Factors, C-11 and C-14.
    CHECK_THAT(incident_w(light.bodies[1], LightCause::bodies), WithinRel(edge ? 0.200044 : 0.199825, 3e-3));
    CHECK_THAT(light.bodies[0].sums.emitted_w, WithinRel(1.0, 1e-6));
    CHECK(incident_w(light.bodies[0], LightCause::bodies) == 0);
}

TEST_CASE("a closed room absorbs all that its lamp gives", "[received]") {
    scene::Scene s = empty_scene(0);
    const double albedo = 0.7;
    s.bodies = {body("room", test::inward_cube(), LambertParameters{albedo})};
    scene::Lamp lamp;
    lamp.name = "bulb";
    lamp.intensity_w_sr = std::vector<double>(s.bands.size(), 2.0);
    s.lamps = {lamp};
    ReceivedLightSettings settings;
    settings.points = 1024;
    settings.directions = 512;
    settings.max_bounces = 100;
    const ReceivedLight light = light_of(s, settings);
    const double power = 4 * pi * 2.0;
    const ReceivedSums& sums = light.bodies[0].sums;
    CHECK_THAT(incident_w(light.bodies[0], LightCause::lamps), WithinRel(power, 1e-3));
    CHECK_THAT(sums.absorbed_w, WithinRel(power, 1e-3));
    CHECK_THAT(sums.leaving_w, WithinRel(albedo * power / (1 - albedo), 1e-3));
    // All sides are alike: E = P / (A (1 - albedo)) on each facet.
    const auto& direct = light.bodies[0].incident_w_m2[static_cast<std::size_t>(LightCause::lamps)];
    const auto& diffuse = light.bodies[0].incident_w_m2[static_cast<std::size_t>(LightCause::bodies)];
    for (std::size_t k = 0; k < direct.size(); ++k)
        CHECK_THAT(direct[k] + diffuse[k], WithinRel(power / (24 * (1 - albedo)), 0.03));
    // Light in a closed room pushes it nowhere.
    CHECK(length(sums.force_n) < 0.02 * power / light_speed_m_s);
    CHECK(light.inner_share == 0);
}

TEST_CASE("a plate in planetshine receives what the planet's phase says", "[received]") {
    const double phase = GENERATE(0.0, pi / 3, pi / 2, 2.2);
    const bool lambert = GENERATE(true, false);
    scene::Scene s = empty_scene(1);
    const double radius = 1e6, distance = 1e10; // far: the phase laws are those of infinite distance
    const scene::Material law =
        lambert ? scene::Material(LambertParameters{0.3}) : scene::Material(LommelSeeligerParameters{0.3});
    s.bodies = {body("planet", EllipsoidParameters{{radius, radius, radius}}, law),
                body("plate", unit_square(), LambertParameters{0.0})};
    // The Sun is along -x; the plate faces the planet.
    const Vec3 at = distance * Vec3{-std::cos(phase), std::sin(phase), 0};
    s.bodies[1].motion.samples[0].pose = {at, look_along(-at, {0, 0, 1})};
    ReceivedLightSettings settings;
    settings.far_directions = 8192;
    settings.rows = 180;
    settings.bodies = {"plate"};
    const ReceivedLight light = light_of(s, settings);
    const double lambert_phase = (std::sin(phase) + (pi - phase) * std::cos(phase)) / pi;
    const double seeliger_phase =
        phase > 0 ? 1 - std::sin(phase / 2) * std::tan(phase / 2) * std::log(1 / std::tan(phase / 4)) : 1;
    // Geometric albedos: 2/3 A, and w / 8.
    const double expected = (lambert ? 2.0 / 3 * 0.3 * lambert_phase : 0.3 / 8 * seeliger_phase) *
                            sun_w_m2(s) * radius * radius / (distance * distance);
    CHECK_THAT(incident_w(light.bodies[0], LightCause::planetshine),
               WithinRel(expected, phase > 2 ? 0.02 : 5e-3));
    CHECK(incident_w(light.bodies[0], LightCause::bodies) == 0);
}

TEST_CASE("sunlight pushes a sphere as its law says", "[received]") {
    scene::Scene s = empty_scene(1);
    const bool mirror = GENERATE(false, true);
    const double albedo = 0.6, radius = 2;
    s.bodies = {
        body("ball", EllipsoidParameters{{radius, radius, radius}},
             mirror ? scene::Material(MirrorParameters{albedo}) : scene::Material(LambertParameters{albedo}),
             {{3, 4, 5}, axis_angle(normalized(Vec3{1, 2, 3}), 1)})};
    ReceivedLightSettings settings;
    settings.points = 4;
    settings.photons = 0;
    const ReceivedLight light = light_of(s, settings);
    const BodyReceivedLight& ball = light.bodies[0];
    const double power = sun_w_m2(s) * pi * radius * radius;
    CHECK_THAT(incident_w(ball, LightCause::sun), WithinRel(power, 1e-3));
    CHECK_THAT(ball.sums.absorbed_w, WithinRel((1 - albedo) * power, 1e-3));
    // A mirror ball throws light to all sides alike: what it reflects pushes it not at all.
    const Vec3 force = rotate(ball.to_inertial, ball.sums.force_n);
    const double expected = power / light_speed_m_s * (mirror ? 1 : 1 + 4.0 / 9 * albedo);
    CHECK_THAT(force.x, WithinRel(expected, 2e-3)); // away from the Sun
    CHECK(std::hypot(force.y, force.z) < 2e-3 * expected);
    CHECK(length(ball.sums.torque_nm) < 2e-3 * expected * radius);
    CHECK_THAT(ball.sums.lit_area_m2, WithinRel(2 * pi * radius * radius, 5e-3));
}

TEST_CASE("a plane mirror throws sunlight on a wall", "[received]") {
    scene::Scene s = empty_scene(1);
    const double r = 0.9;
    // A mirror in the x-y plane, the Sun 45 degrees above -x, a wall at x = 2 from z = 1 to 2 that faces -x.
    s.sun.position_m = astronomical_unit_m * normalized(Vec3{-1, 0, 1});
    PolygonsParameters wall;
    wall.faces_m = {{{2, -5, 1}, {2, -5, 2}, {2, 5, 2}, {2, 5, 1}}};
    PolygonsParameters glass;
    glass.faces_m = {{{-5, -9, 0}, {3, -9, 0}, {3, 9, 0}, {-5, 9, 0}}};
    s.bodies = {body("glass", glass, MirrorParameters{r}), body("wall", wall, LambertParameters{0.5})};
    ReceivedLightSettings settings;
    settings.photons = 1 << 18;
    const ReceivedLight light = light_of(s, settings);
    const double direct = sun_w_m2(s) * std::sqrt(0.5) * 10;
    CHECK_THAT(incident_w(light.bodies[1], LightCause::sun), WithinRel(direct, 1e-4));
    CHECK_THAT(incident_w(light.bodies[1], LightCause::caustic), WithinRel(r * direct, 5e-3));
    const double on_glass =
        incident_w(light.bodies[0], LightCause::sun) + incident_w(light.bodies[0], LightCause::bodies);
    CHECK_THAT(light.bodies[0].sums.absorbed_w, WithinRel((1 - r) * on_glass, 1e-5));
}

TEST_CASE("received light does not depend on threads, and keeps what patches see", "[received]") {
    scene::Scene s = empty_scene(1);
    ProceduralBodyParameters rock;
    rock.mean_radius_m = 10;
    rock.subdivisions = 4;
    s.bodies = {body("rock", rock, LambertParameters{0.4})};
    ReceivedLightSettings settings;
    settings.threads = 1;
    ReceivedLightMap one(s, settings);
    settings.threads = 7;
    ReceivedLightMap seven(s, settings);
    const ReceivedLight a = one.at(0).value(), b = seven.at(0).value();
    CHECK(a.bodies[0].absorbed_w_m2 == b.bodies[0].absorbed_w_m2);
    CHECK(a.bodies[0].sums.force_n == b.bodies[0].sums.force_n);
    CHECK(a.bodies[0].sums.torque_nm == b.bodies[0].sums.torque_nm);
    // Another Sun is as in a scene of its own.
    const Vec3 sun{0, 2 * astronomical_unit_m, 0};
    const ReceivedLight moved = one.at(0, sun).value();
    s.sun.position_m = sun;
    const ReceivedLight own = light_of(s, settings);
    CHECK(moved.bodies[0].radiosity_w_m2 == own.bodies[0].radiosity_w_m2);
    CHECK(moved.rays == own.rays);
    CHECK(one.at(0).value().bodies[0].absorbed_w_m2 == a.bodies[0].absorbed_w_m2);
    // What is not absorbed leaves, to space at last.
    const double in = incident_w(a.bodies[0], LightCause::sun) + incident_w(a.bodies[0], LightCause::bodies);
    CHECK_THAT(in - a.bodies[0].sums.absorbed_w, WithinRel(a.bodies[0].sums.leaving_w, 1e-3));
    CHECK_THROWS_WITH(ReceivedLightMap(s, {.bodies = {"rook"}}),
                      Catch::Matchers::ContainsSubstring("did you mean \"rock\"?"));
}

} // namespace received_light_test
