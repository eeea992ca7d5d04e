// SPDX-License-Identifier: Apache-2.0
// Sky objects: phase laws against skyfield, variation, motion, galaxies against their profile, hiding, keys.
#include "core/error.hpp"
#include "core/solar_spectrum.hpp"
#include "renderer/lights/galaxy.hpp"
#include "renderer/lights/star_spectra.hpp"
#include "renderer/materials/lambert.hpp"
#include "renderer/scene/sky_object.hpp"
#include "renderer/scene_files/scene_file.hpp"
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/truth/scene_truth.hpp"
#include "renderer/world/sky_sources.hpp"
#include "support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/temp_folder.hpp"

#include <cmath>
#include <numbers>
#include <numeric>

namespace sky_objects_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::Contains;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using scene::Planet;
using scene::SkyObject;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr std::int32_t size = 96;
constexpr double pixel_rad = 1e-4;

/// A camera at the origin that looks along +x, north up; the Sun behind it, at 1 au.
scene::Scene scene_with(const SkyObject& object) {
    scene::Scene s;
    s.sun.position_m = {-astronomical_unit_m, 0, 0};
    s.camera.width = s.camera.height = size;
    s.camera.pixel_pitch_m = 10e-6;
    s.camera.focal_length_m = s.camera.pixel_pitch_m / pixel_rad;
    s.camera.psf_sigma_px = 0.7;
    s.camera.motion.samples[0].pose.orientation = look_along({1, 0, 0}, {0, 0, 1});
    s.sky_objects = std::make_shared<const std::vector<SkyObject>>(std::vector{object});
    return s;
}

struct Light {
    double sum = 0, x = 0, y = 0;
};

Light light_of(const scene::Scene& s, double time_s = 0, std::int64_t exposure_ns = 0) {
    const std::vector<float> image = render_window(Renderer(s, {}), {0, 0, size, size}, 32, 1,
                                                   Time{std::llround(time_s * 1e9)}, exposure_ns);
    Light light;
    for (std::int32_t y = 0; y < size; ++y)
        for (std::int32_t x = 0; x < size; ++x) {
            const double e = image[static_cast<std::size_t>(y) * size + static_cast<std::size_t>(x)];
            light.sum += e, light.x += e * x, light.y += e * y;
        }
    light.x /= light.sum, light.y /= light.sum;
    return light;
}

SkyObject planet(Planet which) {
    SkyObject object;
    object.kind = SkyObject::Kind::point;
    object.planet = which;
    return object;
}

} // namespace

TEST_CASE("planets as points have the published magnitudes", "[sky]") {
    // skyfield.magnitudelib: _mercury_magnitude(1, 1, 90) and so on; Saturn's with rings=False.
    const struct {
        Planet planet;
        double phase_deg, v;
    } rows[] = {
        {Planet::mercury, 0, -0.613},    {Planet::mercury, 90, 2.258324},  {Planet::mercury, 150, 5.933834},
        {Planet::venus, 2, -4.384636},   {Planet::venus, 100, -2.721600},  {Planet::venus, 170, -0.714694},
        {Planet::earth, 60, -3.314160},  {Planet::mars, 30, -1.038080},    {Planet::mars, 90, 0.107750},
        {Planet::jupiter, 5, -9.381450}, {Planet::jupiter, 60, -8.635608}, {Planet::saturn, 3, -8.945566},
        {Planet::saturn, 30, -8.728983}, {Planet::uranus, 2, -7.110},      {Planet::neptune, 1, -7.00}};
    for (const auto& row : rows) {
        CAPTURE(static_cast<int>(row.planet), row.phase_deg);
        CHECK_THAT(scene::phase_magnitude_v(planet(row.planet), row.phase_deg * degree),
                   WithinAbs(row.v, 1e-6));
    }
}

TEST_CASE("a point in space has the light of its distances and phase angle", "[sky]") {
    // Seen from the origin at 2 au along +x, the Sun at (0, 1 au, 0): r = sqrt(5) au, phase angle atan(1/2).
    SkyObject object;
    object.kind = SkyObject::Kind::point;
    object.star.magnitude_v = 3;
    object.phase_law_mag = {0.02, 1e-4};
    object.motion.samples[0].pose.position_m = {2 * astronomical_unit_m, 0, 0};
    scene::Scene s = scene_with(object);
    s.sun.position_m = {0, astronomical_unit_m, 0};
    const double phase_deg = std::atan2(1.0, 2.0) / degree;
    scene::Star equal;
    equal.magnitude_v =
        3 + 0.02 * phase_deg + 1e-4 * phase_deg * phase_deg + 5 * std::log10(2 * std::sqrt(5.0));
    const Light light = light_of(s);
    CHECK_THAT(light.sum, WithinRel(star_irradiance_w_m2(equal, s.bands[0]), 1e-5));
    CHECK_THAT(light.x, WithinAbs((size - 1) / 2.0, 1e-3));
    CHECK_THAT(light.y, WithinAbs((size - 1) / 2.0, 1e-3));
}

TEST_CASE("a point is hidden behind a body and seen before it", "[sky]") {
    SkyObject object;
    object.kind = SkyObject::Kind::point;
    object.star.magnitude_v = -26;
    for (const bool behind : {false, true}) {
        object.motion.samples[0].pose.position_m = {behind ? 3e6 : 1e6, 0, 0};
        scene::Scene with = scene_with(object);
        with.bodies.push_back({"ball", EllipsoidParameters{{2000, 2000, 2000}}, LambertParameters{0.1}, {}});
        with.bodies[0].motion.samples[0].pose.position_m = {2e6, 0, 0};
        scene::Scene without = with;
        without.sky_objects.reset();
        const double more = light_of(with).sum - light_of(without).sum;
        if (behind)
            CHECK(more == 0);
        else
            CHECK(more > 0);
    }
}

TEST_CASE("a variable star follows its sine, a false star its motion", "[sky]") {
    SkyObject object;
    object.star.magnitude_v = 2;
    object.amplitude_mag = 0.5;
    object.period_s = 8;
    object.phase = 0.25;
    const scene::Scene s = scene_with(object);
    const double mean = star_irradiance_w_m2(object.star, s.bands[0]);
    for (const double t : {0.0, 1.0, 2.0, 3.5})
        CHECK_THAT(
            light_of(s, t).sum,
            WithinRel(mean * std::pow(10, -0.4 * 0.5 * std::sin(2 * std::numbers::pi * (t / 8 + 0.25))),
                      1e-5));

    object.amplitude_mag = 0;
    object.rate_rad_s = {-3 * pixel_rad, 2 * pixel_rad};
    const scene::Scene moving = scene_with(object);
    const Light begin = light_of(moving, 0), end = light_of(moving, 4);
    // West is right and north is up in a camera that looks along +x with +z up.
    CHECK_THAT(end.x - begin.x, WithinAbs(12, 1e-2));
    CHECK_THAT(end.y - begin.y, WithinAbs(-8, 1e-2));
    // A streak has the light of the star at rest, and its middle.
    const Light streak = light_of(moving, 2, 4'000'000'000);
    CHECK_THAT(streak.sum, WithinRel(begin.sum, 1e-5));
    CHECK_THAT(streak.x, WithinAbs((begin.x + end.x) / 2, 1e-2));
}

TEST_CASE("a galaxy has the light, profile and shape of its description", "[sky]") {
    SkyObject galaxy;
    galaxy.kind = SkyObject::Kind::galaxy;
    galaxy.star.magnitude_v = 6;
    galaxy.half_light_radius_rad = 5 * pixel_rad;
    for (const double index : {1.0, 4.0}) {
        galaxy.sersic_index = index;
        galaxy.axis_ratio = 1;
        std::vector<double> radii;
        for (const Vec3 d : galaxy_points(galaxy))
            radii.push_back(std::hypot(d.y, d.z) / d.x / galaxy.half_light_radius_rad);
        const auto within = [&](double r) {
            return static_cast<double>(
                       std::count_if(radii.begin(), radii.end(), [&](double x) { return x < r; })) /
                   static_cast<double>(radii.size());
        };
        CHECK_THAT(within(1), WithinAbs(0.5, 1e-3));
        // An exponential disc has 1 - (1 + x) exp(-x) of its light within x = 1.67835 r.
        if (index == 1)
            for (const double r : {0.3, 2.0, 3.0})
                CHECK_THAT(within(r), WithinAbs(1 - (1 + 1.67835 * r) * std::exp(-1.67835 * r), 2e-3));
        // De Vaucouleurs: 0.8466 within 4 half-light radii (incomplete gamma function P(8, 7.66925 4^0.25)).
        if (index == 4) CHECK_THAT(within(4), WithinAbs(0.8466, 2e-3));
    }
    galaxy.sersic_index = 1;
    galaxy.axis_ratio = 0.4;
    galaxy.position_angle_rad = 90 * degree; // the major axis along the rows
    double across = 0, down = 0;
    for (const Vec3 d : galaxy_points(galaxy))
        across += d.y * d.y, down += d.z * d.z;
    CHECK_THAT(std::sqrt(down / across), WithinAbs(0.4, 0.01));
    const scene::Scene s = scene_with(galaxy);
    const Light light = light_of(s);
    CHECK_THAT(light.sum, WithinRel(star_irradiance_w_m2(galaxy.star, s.bands[0]), 5e-3)); // some is outside
    CHECK_THAT(light.x, WithinAbs((size - 1) / 2.0, 0.1));
    // The truth table has its centre and all of its light.
    const std::vector<RowTime> rows(size, RowTime{Time{-5}, Time{5}});
    FrameWindow window;
    window.sensor = {0, 0, size, size};
    TruthRequest request;
    request.windows = {&window, 1};
    request.rows = rows;
    SceneTruth truth;
    Renderer(s, {}).list_truth(request, truth);
    REQUIRE(truth.entries.size() == 2); // and the Sun, which is behind the camera
    const TruthEntry& entry = truth.entries.back();
    CHECK(entry.kind == TruthKind::galaxy);
    CHECK(entry.object == -1);
    CHECK(entry.magnitude_v == 6);
    CHECK_THAT(entry.x_px, WithinAbs((size - 1) / 2.0, 1e-6));
    CHECK_THAT(entry.x_px, WithinAbs(light.x, 0.1));
    CHECK_THAT(entry.y_px, WithinAbs(light.y, 0.1));
    CHECK_THAT(entry.irradiance_w_m2, WithinRel(light.sum, 5e-3));
    CHECK(std::isnan(entry.peak_e));
}

TEST_CASE("sky objects of scene files", "[sky]") {
    const TempFolder folder;
    const auto load = [&](std::string_view text) {
        return scene::load_scene(folder.write("scene.toml", text));
    };
    const scene::Scene s =
        load("[[sky_object]]\nra_deg = 10\ndec_deg = -20\nv_mag = 4\nspectral_type = \"G8III\"\n"
             "[[sky_object]]\nname = \"sat\"\nkind = \"point\"\nposition_m = [1e7, 0, 0]\nv_mag = -26.5\n"
             "phase_law_mag = [0.01]\nb_v = 0.8\n"
             "[[sky_object]]\nkind = \"galaxy\"\nra_deg = 10.68\ndec_deg = 41.27\nv_mag = 3.44\n"
             "half_light_radius_arcsec = 900\naxis_ratio = 0.4\nposition_angle_deg = 35\n"
             "[[sky_object]]\nkind = \"point\"\nplanet = \"jupiter\"\nposition_m = [7e11, 0, 0]\n");
    REQUIRE(s.stars.size() == 1); // one that does not move is as a star of the catalogue
    CHECK(s.stars[0].magnitude_v == 4);
    CHECK(s.stars[0].type->number == Approx(4.8));
    REQUIRE(s.sky_objects);
    REQUIRE(s.sky_objects->size() == 3);
    CHECK((*s.sky_objects)[0].name == "sat");
    CHECK((*s.sky_objects)[0].star.colour_b_v == 0.8);
    CHECK((*s.sky_objects)[0].motion.samples[0].pose.position_m.x == 1e7);
    CHECK((*s.sky_objects)[1].half_light_radius_rad == Approx(0.25 * degree));
    CHECK((*s.sky_objects)[2].star.colour_b_v == 0.87);
    CHECK_THROWS_WITH(load("[[sky_object]]\nv_mag = 3\ndec_deg = 1\n"), Contains("ra_deg"));
    CHECK_THROWS_WITH(load("[[sky_object]]\nra_deg = 1\ndec_deg = 1\nv_mag = 3\nplanet = \"mars\"\n"),
                      Contains("scene.toml:5:") && Contains("belongs to kind = \"point\""));
    CHECK_THROWS_WITH(
        load("[[sky_object]]\nkind = \"point\"\nv_mag = 3\nposition_m = [1,2,3]\nparent = \"io\"\n"),
        Contains("io"));
    CHECK_THROWS_WITH(load("[[sky_object]]\nra_deg = 1\ndec_deg = 1\nv_mag = nan\n"),
                      Contains("scene.toml:4:"));
    CHECK_THROWS_WITH(load("[[sky_object]]\nra_deg = 1\ndec_deg = 1\nv_mag = 3\nspectral_type = \"Q\"\n"),
                      Contains("spectral_type"));
}

} // namespace sky_objects_test
