// SPDX-License-Identifier: Apache-2.0
#include "core/philox.hpp"
#include "models/kinds/shape_checks.hpp"
#include "models/kinds/shape_march.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

namespace shape_program_test {

using namespace obscura;
using namespace obscura::models;
using Catch::Matchers::ContainsSubstring;

namespace {

ShapeProgram shape(const std::string& text, Vec3 radii_m = {}, NativeTarget target = native_target()) {
    const auto model = Model::parse("body.shp", text);
    ShapeParameters parameters{default_parameters(*model)};
    parameters.target = target;
    parameters.radii_m = radii_m;
    return {model, parameters};
}

std::string outside(const std::string& expression, double radius) {
    return "scalar bound_radius() { return " + std::to_string(radius) +
           "; }\nscalar outside(vec3 p) { return " + expression + "; }";
}

Vec3 direction_of(std::uint32_t i, std::uint32_t k) {
    const auto w = philox4x32({i, k, 0, 0}, philox_key(23));
    const double z = 2 * uniform_double(w[0]) - 1, a = 2 * std::numbers::pi * uniform_double(w[1]);
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(a), r * std::sin(a), z};
}

/// Rays from points at `distance` to points within `reach` of the origin.
ShapeRays rays_to(std::uint32_t packet, double distance, double reach) {
    ShapeRays rays;
    for (std::uint32_t i = 0; i < shape_lanes; ++i) {
        const std::uint32_t n = packet * 16 + i;
        rays.origin[i] = distance * direction_of(n, 0);
        const double share = uniform_double(philox4x32({n, 2, 0, 0}, philox_key(23))[0]);
        rays.direction[i] = normalized(reach * share * direction_of(n, 1) - rays.origin[i]);
        rays.t_max[i] = std::numeric_limits<double>::infinity();
    }
    return rays;
}

/// Differences between hits and what `nearest` says of each ray, which are within `tolerance_m` but for rays
/// that pass the surface within `graze_m` of the way.
template<typename Nearest>
void compare(const ShapeProgram& program, double distance, double reach, std::uint32_t packets,
             double tolerance_m, const Nearest& nearest) {
    double worst = 0;
    int holes = 0, doubtful = 0, hit = 0;
    std::uint64_t evaluations = 0;
    for (std::uint32_t packet = 0; packet < packets; ++packet) {
        const ShapeRays rays = rays_to(packet, distance, reach);
        ShapeHits hits;
        trace(program, rays, hits);
        evaluations += hits.evaluations;
        for (std::size_t i = 0; i < shape_lanes; ++i) {
            const double wanted = nearest(rays.origin[i], rays.direction[i]);
            doubtful += hits.doubtful[i] ? 1 : 0;
            if (std::isnan(wanted)) continue; // grazes
            if (std::isfinite(wanted) != std::isfinite(hits.t[i])) {
                ++holes;
                continue;
            }
            if (!std::isfinite(wanted)) continue;
            ++hit;
            worst = std::max(worst, std::abs(hits.t[i] - wanted));
        }
    }
    INFO("evaluations a packet " << double(evaluations) / packets << ", hits " << hit << ", cells "
                                 << program.cells().surface_cells());
    UNSCOPED_INFO("evaluations " << double(evaluations) / packets);
    CHECK(holes == 0);
    CHECK(doubtful == 0);
    CHECK(hit > 0);
    CHECK(worst <= tolerance_m);
}

/// Nearest root of the quartic of a torus of radii R and r, by scanning its sign in long double; NaN where a
/// ray grazes.
double torus_distance(Vec3 o, Vec3 d, double big, double small) {
    const auto value = [&](long double t) {
        const long double x = o.x + t * d.x, y = o.y + t * d.y, z = o.z + t * d.z;
        const long double s = x * x + y * y + z * z + static_cast<long double>(big) * big -
                              static_cast<long double>(small) * small;
        return s * s - 4 * static_cast<long double>(big) * big * (x * x + y * y);
    };
    const double reach = big + small;
    const double along = -dot(o, d);
    const double rest = reach * reach - length_squared(o + along * d);
    if (rest <= 0) return std::numeric_limits<double>::infinity();
    const long double half = std::sqrt(rest);
    constexpr int steps = 4000;
    long double before = value(along - half), least = 1e30L;
    const long double scale = 8 * static_cast<long double>(big) * big * small;
    for (int k = 1; k <= steps; ++k) {
        long double low = along - half + 2 * half * (k - 1) / steps, high = low + 2 * half / steps;
        const long double here = value(high);
        least = std::min(least, std::abs(here) / scale);
        if (before > 0 && here <= 0) {
            for (int n = 0; n < 80; ++n) {
                const long double middle = (low + high) / 2;
                (value(middle) > 0 ? low : high) = middle;
            }
            return static_cast<double>(low);
        }
        before = here;
    }
    // A pass that is closer than the scan can tell.
    return least < 1e-5L ? std::numeric_limits<double>::quiet_NaN() : std::numeric_limits<double>::infinity();
}

double sphere_distance(Vec3 o, Vec3 d, double radius) {
    const double along = -dot(o, d);
    const Vec3 closest = o + along * d;
    const double rest = radius * radius - length_squared(closest);
    if (std::abs(rest) < 1e-11 * radius * radius) return std::numeric_limits<double>::quiet_NaN();
    const double t = rest > 0 ? along - std::sqrt(rest) : -1;
    return t > 0 ? t : std::numeric_limits<double>::infinity();
}

} // namespace

TEST_CASE("rays meet a sphere where its formula says") {
    const auto text = GENERATE(outside("length(p) - 500", 600), outside("(p | p) - 250000", 600),
                               outside("length(p) - 500", 500.001));
    const ShapeProgram program = shape(text);
    CHECK(program.bounding_radius_m() >= 500);
    for (const double distance : {505.0, 2e3, 1e6})
        compare(program, distance, 560, 4000, std::max(500e-9, 4e-16 * distance),
                [](Vec3 o, Vec3 d) { return sphere_distance(o, d, 500); });
}

TEST_CASE("rays meet a torus where its quartic says") {
    const ShapeProgram program = shape(outside("length(vec2(length(p.xy) - 3, p.z)) - 1", 4.1));
    compare(program, 20, 4.2, 400, 4e-9, [](Vec3 o, Vec3 d) { return torus_distance(o, d, 3, 1); });
    compare(program, 4.2, 4.2, 400, 4e-9, [](Vec3 o, Vec3 d) { return torus_distance(o, d, 3, 1); });
}

TEST_CASE("rays meet a box of maxima and a cone with an apex") {
    const ShapeProgram box = shape(outside("max(max(abs(p.x) - 1, abs(p.y) - 2), abs(p.z) - 0.5)", 2.4));
    compare(box, 9, 2.4, 1500, 2.4e-9, [](Vec3 o, Vec3 d) {
        double from = 0, to = 1e30;
        for (const auto& [x, dx, half] :
             {std::array{o.x, d.x, 1.0}, std::array{o.y, d.y, 2.0}, std::array{o.z, d.z, 0.5}}) {
            from = std::max(from, std::min((-half - x) / dx, (half - x) / dx));
            to = std::min(to, std::max((-half - x) / dx, (half - x) / dx));
        }
        if (std::abs(to - from) < 1e-6) return std::numeric_limits<double>::quiet_NaN();
        return from < to ? from : std::numeric_limits<double>::infinity();
    });
    CHECK_NOTHROW(shape(outside("max(length(p.xy) + p.z - 1, -1 - p.z)", 2.5)));
}

TEST_CASE("rays along the faces of cells come to their end") {
    const ShapeProgram program = shape(outside("length(vec2(length(p.xy) - 80, p.z)) - 25", 105.1));
    // Nearly along an axis, through the middle or along other faces of the octree.
    const double cell = 105.1 * (1 + 1e-6) / 8;
    for (const double shift : {0.0, 1e-15, -1e-14, 1e-12})
        for (const double tilt : {0.0, 6e-17, -1e-16, 1e-13})
            for (const double face : {0.0, cell, 6 * cell}) {
                ShapeRays rays;
                for (std::size_t i = 0; i < shape_lanes; ++i) {
                    const double sign = i < 8 ? 1 : -1;
                    rays.origin[i] =
                        i % 2 == 0 ? Vec3{face + shift, shift, 300 * sign} : Vec3{300 * sign, shift, shift};
                    rays.direction[i] =
                        normalized(i % 2 == 0 ? Vec3{tilt, -tilt, -sign} : Vec3{-sign, tilt, tilt});
                    rays.t_max[i] = std::numeric_limits<double>::infinity();
                }
                ShapeHits hits;
                trace(program, rays, hits);
                CHECK(hits.evaluations < 100);
                CHECK(std::isfinite(hits.t[0]) == (face > 0 && std::abs(face - 80) < 25));
                CHECK(std::abs(hits.t[1] - 195) < 1e-7);
            }
}

TEST_CASE("a ray that starts on the surface leaves it") {
    const ShapeProgram program = shape(outside("length(p) - 500", 600));
    int blocked = 0, open = 0;
    for (std::uint32_t packet = 0; packet < 500; ++packet) {
        ShapeRays rays;
        std::array<bool, 16> out{};
        for (std::uint32_t i = 0; i < shape_lanes; ++i) {
            const Vec3 n = direction_of(packet * 16 + i, 0);
            rays.origin[i] = 500 * n;
            const Vec3 any = direction_of(packet * 16 + i, 1);
            // Towards the horizon, at angles down to a microradian.
            const Vec3 flat = normalized(any - dot(any, n) * n);
            const double up = std::pow(10, -6 * (i / 16.0)) * (i % 2 == 0 ? 1 : -1);
            rays.direction[i] = normalized(flat + up * n);
            rays.t_max[i] = std::numeric_limits<double>::infinity();
            out[i] = up > 0;
        }
        ShapeHits hits;
        trace(program, rays, hits);
        for (std::size_t i = 0; i < shape_lanes; ++i) {
            if (out[i] && std::isfinite(hits.t[i])) ++blocked;
            if (!out[i] && !std::isfinite(hits.t[i])) ++open;
            CHECK_FALSE(hits.doubtful[i]);
        }
    }
    CHECK(blocked == 0);
    CHECK(open == 0);
}

TEST_CASE("a ray from within finds the way out, and the end of the search counts") {
    const ShapeProgram program = shape(outside("length(p) - 500", 600));
    ShapeRays rays;
    for (std::size_t i = 0; i < shape_lanes; ++i) {
        rays.origin[i] = i < 8 ? Vec3{0, 0, 100} : Vec3{0, 0, 1000};
        rays.direction[i] = {0, 0, i < 8 ? 1.0 : -1.0};
        rays.t_max[i] = i % 2 == 0 ? 1e9 : 399;
    }
    ShapeHits hits;
    trace(program, rays, hits);
    CHECK(std::abs(hits.t[0] - 400) < 1e-9);
    CHECK(std::abs(hits.t[8] - 500) < 1e-9);
    CHECK_FALSE(std::isfinite(hits.t[1]));
    CHECK_FALSE(std::isfinite(hits.t[9]));
}

TEST_CASE("a claim of the slope is used, and one that is half of the slope is seen") {
    const std::string sphere = outside("length(p) - 500", 600);
    const ShapeProgram right = shape("property lipschitz 1;\n" + sphere);
    CHECK(right.claimed_slope() == 1);
    const ShapeReport sound = report_on(right);
    CHECK(sound.doubtful_share < 0.01); // only rays that graze run out of steps
    const ShapeProgram wrong = shape("property lipschitz 0.5;\n" + sphere);
    const ShapeReport found = report_on(wrong);
    CHECK(found.doubtful_share > 0.999); // of the rays, whether they hit or not
    REQUIRE(warnings_by(found, wrong).size() == 1);
    CHECK_THAT(warnings_by(found, wrong)[0], ContainsSubstring("exceeds the property lipschitz of 0.5"));
    CHECK_THROWS_WITH(shape("property lipschitz 0;\n" + sphere),
                      ContainsSubstring("body.shp:1:") && ContainsSubstring("greater than 0"));
}

TEST_CASE("heights over an ellipsoid are along the radius") {
    const ShapeProgram program =
        shape("scalar height(scalar longitude, scalar latitude)\n"
              "{ return 5 * cos(latitude) * cos(latitude) * cos(4 * longitude) + 2 * sin(latitude); }",
              {100, 90, 80});
    CHECK(program.bounding_radius_m() < 108);
    CHECK(program.bounding_radius_m() > 105);
    const auto surface = [](Vec3 p) {
        const Vec3 u = normalized(p);
        const double lon = std::atan2(u.y, u.x), c = std::hypot(u.x, u.y);
        return 1 / std::sqrt(u.x * u.x / 1e4 + u.y * u.y / 8100 + u.z * u.z / 6400) +
               5 * c * c * std::cos(4 * lon) + 2 * u.z;
    };
    int holes = 0, doubtful = 0;
    double worst = 0;
    for (std::uint32_t packet = 0; packet < 2000; ++packet) {
        const ShapeRays rays = rays_to(packet, 1000, 75);
        ShapeHits hits;
        trace(program, rays, hits);
        for (std::size_t i = 0; i < shape_lanes; ++i) {
            doubtful += hits.doubtful[i] ? 1 : 0;
            if (!std::isfinite(hits.t[i])) {
                ++holes;
                continue;
            }
            const Vec3 p = rays.origin[i] + hits.t[i] * rays.direction[i];
            worst = std::max(worst, std::abs(length(p) - surface(p)));
        }
    }
    CHECK(holes == 0);
    CHECK(doubtful == 0);
    CHECK(worst < 1e-9 * 100);
    CHECK(report_on(program).doubtful_share == 0);
}

TEST_CASE("a function without a surface is refused, and doubtful rays are reported") {
    CHECK_THROWS_WITH(shape("scalar outside(vec3 p) { return length(p) - 1; }"),
                      ContainsSubstring("body.shp:1:8: ") && ContainsSubstring("scalar bound_radius()"));
    CHECK_THROWS_WITH(shape(outside("length(p) - 1", -1)), ContainsSubstring("bound_radius() is -1 m"));
    CHECK_THROWS_WITH(shape("scalar height(scalar a, scalar b) { return 1; }"), ContainsSubstring("radii_m"));
    CHECK_THROWS_WITH(shape("scalar height(scalar a, scalar b) { return -2 * cos(b); }", {1, 1, 1}),
                      ContainsSubstring("allowed are heights above -1 m"));
    CHECK_THROWS_WITH(shape(outside("p.z + sqrt(abs(p.x))", 1)), ContainsSubstring("has no bound near"));
    CHECK_THROWS_WITH(shape("scalar inside(vec3 p) { return 1; }"),
                      ContainsSubstring("a function is missing"));

    const auto refusal = [](const std::string& text) {
        const ShapeProgram program = shape(text);
        return refusal_by(report_on(program), program);
    };
    CHECK_THAT(refusal(outside("length(p) + 1", 3)), ContainsSubstring("no sign change"));
    CHECK_THAT(refusal(outside("length(p) - 5", 3)), ContainsSubstring("all is inside"));
    CHECK(refusal(outside("length(p) - 2", 3)).empty());
    const auto warning = [](const std::string& text) {
        const ShapeProgram program = shape(text);
        const auto lines = warnings_by(report_on(program), program);
        return lines.empty() ? std::string() : lines.back();
    };
    CHECK(warning(outside("length(p) - 2", 3)).empty());
    CHECK_THAT(warning(outside("length(p.xy) - 2", 3)), ContainsSubstring("leaves the bound of 3 m"));
    CHECK_THAT(warning(outside("max(length(p) - 2, abs(p.z) - 0.0005)", 3)),
               ContainsSubstring("only 0.001 m thick"));
    CHECK_THAT(warning(outside("length(p) - 2 + 0.2 * floor(p.x)", 4)), ContainsSubstring("the value jumps"));
}

TEST_CASE("machine code and the interpreter find the same hits") {
    const std::string text = outside("length(vec2(length(p.xy) - 3, p.z)) - 1 + 0.05 * sin(9 * p.x)", 4.2);
    const ShapeProgram native = shape(text), interpreted = shape(text, {}, NativeTarget::none);
    int different = 0;
    for (std::uint32_t packet = 0; packet < 300; ++packet) {
        const ShapeRays rays = rays_to(packet, 20, 4.2);
        ShapeHits a, b;
        trace(native, rays, a);
        trace(interpreted, rays, b);
        for (std::size_t i = 0; i < shape_lanes; ++i)
            if (a.t[i] != b.t[i] || a.doubtful[i] != b.doubtful[i]) ++different;
    }
    CHECK(different == 0);
}

} // namespace shape_program_test
