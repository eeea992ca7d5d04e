// SPDX-License-Identifier: Apache-2.0
#include "models/kinds/projection_checks.hpp"
#include "tests/support/catch.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

namespace projection_program_test {

using namespace obscura;
using namespace obscura::models;

namespace {

/// Square pixels about the axis.
SensorPlane sensor(double focal_length_m, double pitch_m, int width, int height) {
    SensorPlane plane;
    plane.focal_length_m = focal_length_m;
    plane.width = width;
    plane.height = height;
    plane.column_m = {pitch_m, 0};
    plane.row_m = {0, pitch_m};
    plane.first_m = {-(width - 1) / 2.0 * pitch_m, -(height - 1) / 2.0 * pitch_m};
    return plane;
}

ProjectionProgram program(const std::string& text, const SensorPlane& plane,
                          NativeTarget target = NativeTarget::none) {
    auto model = Model::parse("lens.prj", text);
    ModelParameters parameters = default_parameters(*model);
    parameters.target = target;
    return {model, parameters, plane};
}

/// Directions of image points.
struct Seen {
    std::vector<double> x, y, dx, dy, dz, solid_angle;
    Seen(const ProjectionProgram& p, int columns, int rows) {
        for (int i = 0; i < columns * rows; ++i) {
            x.push_back(-0.5 + p.plane().width * (i % columns + 0.37) / columns);
            y.push_back(-0.5 + p.plane().height * (i / columns + 0.61) / rows);
        }
        dx = dy = dz = solid_angle = x;
        p.rays(x.data(), y.data(), {dx.data(), dy.data(), dz.data()}, solid_angle.data(), x.size());
    }
};

constexpr const char* fisheye = R"(
parameter k1 -0.03;
parameter k2 0.004;
vec2 point(vec3 d)
{
    scalar across = max(length(d.xy), 1e-300);
    scalar t = atan2(across, d.z);
    if (t > 2) return vec2(M_NAN);
    return d.xy * (focal_length * t * (1 + t * t * (k1 + t * t * k2)) / across);
}
)";

/// The same, by the angle of a radius: the root of the polynomial by bisection.
double angle_of(double radius) {
    double low = 0, high = 2;
    for (int i = 0; i < 200; ++i) {
        const double t = (low + high) / 2;
        (t * (1 + t * t * (-0.03 + t * t * 0.004)) < radius ? low : high) = t;
    }
    return (low + high) / 2;
}

} // namespace

TEST_CASE("rays of a fisheye that has only point() are those of its polynomial's root", "[models]") {
    const SensorPlane plane = sensor(5e-3, 10e-6, 1024, 1024);
    const ProjectionProgram p = program(fisheye, plane);
    const Seen seen(p, 64, 64);
    for (std::size_t i = 0; i < seen.x.size(); ++i) {
        const double px = (seen.x[i] - 511.5) * 2e-3, py = (seen.y[i] - 511.5) * 2e-3;
        const double r = std::hypot(px, py), t = angle_of(r);
        const double error = std::hypot(seen.dx[i] - std::sin(t) * px / r, seen.dy[i] - std::sin(t) * py / r,
                                        seen.dz[i] - std::cos(t));
        REQUIRE(error < 1e-9 * 2e-3); // 1e-9 px
        // sin t dt / (r dr) for each area of the plane over the focal length squared.
        const double slope = 1 + t * t * (3 * -0.03 + t * t * 5 * 0.004);
        REQUIRE(seen.solid_angle[i] == Approx(4e-6 * std::sin(t) / (r * slope)).epsilon(1e-9));
    }
    CHECK(p.newton_steps() >= 2);
    const ProjectionReport report = report_on(p);
    CHECK(refusal_by(report).empty());
    CHECK(report.seen_share == Approx(1));
    CHECK(report.round_trip_px < 1e-9);
}

TEST_CASE("a projection with ray() alone has the points of its inverse", "[models]") {
    const SensorPlane plane = sensor(20e-3, 10e-6, 640, 480);
    // A pinhole whose sensor is tilted by 8 degrees about its columns.
    const ProjectionProgram p = program(R"(
parameter tilt 8; //! deg, -30..30, Tilt
vec3 ray(vec2 p)
{
    return 7 * vec3(p.x * cos(tilt), p.y, focal_length + p.x * sin(tilt));
}
)",
                                        plane);
    const double tilt = 8 * std::numbers::pi / 180;
    const Seen seen(p, 32, 32);
    std::vector<double> x(seen.x.size()), y(x);
    p.project({seen.dx.data(), seen.dy.data(), seen.dz.data()}, x.data(), y.data(), x.size());
    for (std::size_t i = 0; i < x.size(); ++i) {
        // The direction meets the plane of the sensor: p.x cos / (f + p.x sin) = dx / dz.
        const double s = seen.dx[i] / seen.dz[i], v = seen.dy[i] / seen.dz[i];
        const double px = s * 20e-3 / (std::cos(tilt) - s * std::sin(tilt));
        const double py = v * (20e-3 + px * std::sin(tilt));
        REQUIRE(px / 10e-6 + 319.5 == Approx(seen.x[i]).margin(1e-9));
        REQUIRE(x[i] == Approx(px / 10e-6 + 319.5).margin(1e-9));
        REQUIRE(y[i] == Approx(py / 10e-6 + 239.5).margin(1e-9));
        // Area of a pixel, seen askew: cos of the ray to the sensor's normal over the distance squared.
        const double distance = std::hypot(px * std::cos(tilt), py, 20e-3 + px * std::sin(tilt));
        const double cosine = 20e-3 * std::cos(tilt) / distance;
        REQUIRE(seen.solid_angle[i] == Approx(1e-10 * cosine / (distance * distance)).epsilon(1e-9));
    }
    CHECK(refusal_by(report_on(p)).empty());
    const std::array<std::array<double, 16>, 3> behind{
        {{}, {}, {-1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1, -1}}};
    p.project({behind[0].data(), behind[1].data(), behind[2].data()}, x.data(), y.data(), 16);
    CHECK(std::isnan(x[0]));
}

TEST_CASE("machine code and interpreter give the same bytes of a projection", "[models]") {
    const SensorPlane plane = sensor(5e-3, 10e-6, 1024, 768);
    const ProjectionProgram interpreted = program(fisheye, plane);
    const ProjectionProgram native = program(fisheye, plane, native_target());
    const Seen a(interpreted, 64, 32), b(native, 64, 32);
    CHECK(a.dx == b.dx);
    CHECK(a.dy == b.dy);
    CHECK(a.dz == b.dz);
    CHECK(a.solid_angle == b.solid_angle);
}

TEST_CASE("projections that cannot be used are refused with their worst pixel", "[models]") {
    const SensorPlane plane = sensor(5e-3, 10e-6, 1024, 1024);
    const auto why = [&](const std::string& text) { return refusal_by(report_on(program(text, plane))); };
    // The image of t - 0.5 t^3 ends at t = 0.8, within the sensor, and goes back.
    CHECK_THAT(why(R"(vec2 point(vec3 d) { scalar s = max(length(d.xy), 1e-300); scalar t = atan2(s, d.z);
                      return d.xy * (focal_length * (t - 0.5 * t * t * t) / s); })"),
               Catch::Matchers::ContainsSubstring("is not one to one: directions at"));
    CHECK_THAT(why("vec3 ray(vec2 p) { return vec3(p.x * p.x, p.y, focal_length); }"),
               Catch::Matchers::ContainsSubstring("mirrored at pixel"));
    CHECK_THAT(why("vec2 point(vec3 d) { return vec2(M_NAN); }"),
               Catch::Matchers::ContainsSubstring("no direction falls on the sensor"));
    CHECK_THAT(
        why(R"(vec2 point(vec3 d) { if (d.z <= 0) return vec2(M_NAN); return d.xy / d.z * focal_length; }
                      vec3 ray(vec2 p) { return vec3(p, 1.001 * focal_length); })"),
        Catch::Matchers::ContainsSubstring("ray() and point() differ by 0.7"));
    CHECK_THAT(
        why(R"(vec2 point(vec3 d) { if (d.z <= 0) return vec2(M_NAN); return d.xy / d.z * focal_length; }
                      scalar transmission(vec3 d) { return 2 * d.z; })"),
        Catch::Matchers::ContainsSubstring("transmission() is"));
    // 0 / 0 in the middle.
    CHECK_THAT(
        why(R"(vec2 point(vec3 d) { scalar s = length(d.xy); return d.xy * focal_length * atan2(s, d.z) / s; })"),
        Catch::Matchers::ContainsSubstring("nothing is seen at pixel (512, 512)"));
    CHECK_THROWS_WITH(Model::parse("lens.prj", "scalar transmission(vec3 d) { return 1; }"),
                      Catch::Matchers::ContainsSubstring(
                          "a function is missing, one of vec2 point(vec3 d), vec3 ray(vec2 p)"));
    CHECK_THROWS_WITH(
        Model::parse("lens.prj",
                     "parameter focal_length 1; vec3 ray(vec2 p) { return vec3(p, focal_length); }"),
        Catch::Matchers::ContainsSubstring("'focal_length' is given by the renderer"));
}

TEST_CASE("a field of more than 180 degrees is found and told", "[models]") {
    const ProjectionProgram p = program(R"(
vec2 point(vec3 d)
{
    scalar s = max(length(d.xy), 1e-300);
    scalar t = atan2(s, d.z);
    return t < 1.9 ? d.xy * (focal_length * t / s) : vec2(M_NAN);
}
)",
                                        sensor(2e-3, 10e-6, 1024, 1024));
    const ProjectionReport report = report_on(p);
    CHECK(refusal_by(report) == "");
    CHECK(report.seen_share > 0.4);
    CHECK(report.seen_share < 0.5); // pi (1.9 f)^2 on a square of 5.12 f
    REQUIRE(warnings_by(report).size() == 1);
    CHECK_THAT(warnings_by(report)[0], Catch::Matchers::ContainsSubstring("from the boresight"));
    CHECK(report.field_deg > 100);
}

TEST_CASE("steep projections are seen everywhere, and what is lost at a rim is told", "[models]") {
    // Stereographic, to 164 degrees from the boresight.
    const ProjectionProgram steep =
        program("vec2 point(vec3 d) { return d.xy * (2 * focal_length / (1 + d.z)); }",
                sensor(5e-4, 10e-6, 1024, 768));
    const Seen seen(steep, 128, 128);
    for (std::size_t i = 0; i < seen.x.size(); ++i) {
        const double u = (seen.x[i] - 511.5) / 50, v = (seen.y[i] - 383.5) / 50, r2 = u * u + v * v;
        REQUIRE(seen.solid_angle[i] == Approx(4e-4 * 16 / ((4 + r2) * (4 + r2))).epsilon(1e-9));
        REQUIRE(seen.dz[i] == Approx((4 - r2) / (4 + r2)).margin(1e-12));
    }
    // Orthographic: the slope at the rim is infinite.
    const ProjectionProgram rim =
        program("vec2 point(vec3 d) { if (d.z <= 0) return vec2(M_NAN); return d.xy * focal_length; }",
                sensor(4e-3, 10e-6, 1024, 768));
    const Seen disc(rim, 128, 128);
    int lost = 0;
    for (std::size_t i = 0; i < disc.x.size(); ++i) {
        const double u = (disc.x[i] - 511.5) / 400, v = (disc.y[i] - 383.5) / 400;
        const bool inside = u * u + v * v < 1;
        lost += inside && disc.solid_angle[i] == 0 ? 1 : 0;
        REQUIRE((inside || disc.solid_angle[i] == 0));
    }
    CHECK(lost < 128 * 128 / 200);
    const ProjectionReport report = report_on(rim);
    CHECK(refusal_by(report) == "");
    REQUIRE(warnings_by(report).size() == 1);
    CHECK_THAT(warnings_by(report)[0], Catch::Matchers::ContainsSubstring("are not found again"));
}

} // namespace projection_program_test
