// SPDX-License-Identifier: Apache-2.0
// Rays to shapes in SuMoL by the ten million: holes, differences from the formula, cost. Argument: rays of
// each.
#include "core/philox.hpp"
#include "models/kinds/shape_march.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <string>
#include <string_view>

namespace {

using namespace obscura;
using namespace obscura::models;

constexpr double infinity = std::numeric_limits<double>::infinity();

Vec3 direction_of(std::uint32_t a, std::uint32_t b) {
    const double z = 2 * uniform_double(a) - 1, angle = 2 * std::numbers::pi * uniform_double(b);
    const double r = std::sqrt(1 - z * z);
    return {r * std::cos(angle), r * std::sin(angle), z};
}

/// Distance of a sphere; NaN where the ray passes its limb within rounding.
double sphere(Vec3 o, Vec3 d) {
    const double along = -dot(o, d), rest = 1 - length_squared(o + along * d);
    if (std::abs(rest) < 1e-13) return std::numeric_limits<double>::quiet_NaN();
    return rest > 0 ? along - std::sqrt(rest) : infinity;
}

struct Body {
    std::string_view name, text;
    double (*distance)(Vec3, Vec3); ///< null: only what is not sure is counted
};
constexpr Body bodies[]{
    {"sphere", "scalar bound_radius() { return 1.2; }\nscalar outside(vec3 p) { return length(p) - 1; }",
     sphere},
    {"sphere of squares",
     "scalar bound_radius() { return 1.2; }\nscalar outside(vec3 p) { return (p | p) - 1; }", sphere},
    {"sphere, claimed",
     "property lipschitz 1;\nscalar bound_radius() { return 1.2; }\nscalar outside(vec3 p) { return length(p) - 1; }",
     sphere},
    {"torus",
     "scalar bound_radius() { return 1.01; }\n"
     "scalar outside(vec3 p) { return length(vec2(length(p.xy) - 0.75, p.z)) - 0.25; }",
     nullptr},
    {"box",
     "scalar bound_radius() { return 1.01; }\nscalar outside(vec3 p) { return max(max(abs(p.x), abs(p.y)), abs(p.z)) - 0.55; }",
     nullptr},
};

void measure(const Body& body, std::uint32_t packets) {
    const auto model = Model::parse("body.shp", std::string(body.text));
    const auto begin = std::chrono::steady_clock::now();
    const ShapeProgram shape(model, ShapeParameters{default_parameters(*model)});
    const std::chrono::duration<double, std::milli> made = std::chrono::steady_clock::now() - begin;
    std::uint64_t holes = 0, hit = 0, doubtful = 0, evaluations = 0;
    double worst = 0;
    std::chrono::duration<double, std::nano> took{};
    for (std::uint32_t packet = 0; packet < packets; ++packet) {
        ShapeRays rays;
        for (std::uint32_t i = 0; i < shape_lanes; ++i) {
            const auto a = philox4x32({packet, i, 0, 0}, philox_key(9)),
                       b = philox4x32({packet, i, 1, 0}, philox_key(9));
            rays.origin[i] = (i % 4 == 0 ? 1.3 : 20.0) * direction_of(a[0], a[1]);
            const double reach = 1.25 * std::sqrt(uniform_double(b[2]));
            rays.direction[i] = normalized(reach * direction_of(b[0], b[1]) - rays.origin[i]);
            rays.t_max[i] = infinity;
        }
        ShapeHits hits;
        const auto start = std::chrono::steady_clock::now();
        trace(shape, rays, hits);
        took += std::chrono::steady_clock::now() - start;
        evaluations += hits.evaluations;
        for (std::size_t i = 0; i < shape_lanes; ++i) {
            hit += std::isfinite(hits.t[i]) ? 1 : 0;
            doubtful += hits.doubtful[i] ? 1 : 0;
            if (body.distance == nullptr) continue;
            const double wanted = body.distance(rays.origin[i], rays.direction[i]);
            if (std::isnan(wanted)) continue;
            if (std::isfinite(wanted) != std::isfinite(hits.t[i]))
                ++holes;
            else if (std::isfinite(wanted))
                worst = std::max(worst, std::abs(hits.t[i] - wanted));
        }
    }
    const double rays = 16.0 * packets;
    std::printf("{\"shape\": \"%s\", \"rays\": %.0f, \"hits\": %llu, \"holes\": %llu, \"worst_radii\": %.3g, "
                "\"doubtful\": %llu, \"ns_a_ray\": %.1f, \"points_a_packet\": %.2f, \"surface_cells\": %zu, "
                "\"made_ms\": %.1f}\n",
                std::string(body.name).c_str(), rays, static_cast<unsigned long long>(hit),
                static_cast<unsigned long long>(holes), worst, static_cast<unsigned long long>(doubtful),
                took.count() / rays, static_cast<double>(evaluations) / packets,
                shape.cells().surface_cells(), made.count());
}

} // namespace

int main(int argc, char** argv) {
    const double rays = argc > 1 ? std::atof(argv[1]) : 1e7;
    for (const Body& body : bodies)
        measure(body, static_cast<std::uint32_t>(rays / 16));
}
