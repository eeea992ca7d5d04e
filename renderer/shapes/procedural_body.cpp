// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/procedural_body.hpp"

#include "core/philox.hpp"
#include "renderer/mesh_files/vertex_normals.hpp"

#include <algorithm>
#include <cmath>
#include <unordered_map>

namespace obscura::renderer {
namespace {

/// Gradient noise on the integer lattice, about -1..1, period none.
/// Perlin, Improving Noise, SIGGRAPH 2002 (quintic fade), with hashed gradients instead of a table.
class Noise {
public:
    Noise(std::uint64_t seed, std::uint32_t layer) : key_(philox_key(seed)), layer_(layer) {}

    [[nodiscard]] double operator()(Vec3 p) const {
        const Vec3 cell{std::floor(p.x), std::floor(p.y), std::floor(p.z)};
        const Vec3 f = p - cell;
        const Vec3 s{fade(f.x), fade(f.y), fade(f.z)};
        const auto ix = static_cast<std::int32_t>(cell.x);
        const auto iy = static_cast<std::int32_t>(cell.y);
        const auto iz = static_cast<std::int32_t>(cell.z);
        double value = 0;
        for (int corner = 0; corner < 8; ++corner) {
            const int cx = corner & 1;
            const int cy = corner >> 1 & 1;
            const int cz = corner >> 2;
            const double weight =
                (cx != 0 ? s.x : 1 - s.x) * (cy != 0 ? s.y : 1 - s.y) * (cz != 0 ? s.z : 1 - s.z);
            value += weight *
                     dot(gradient(ix + cx, iy + cy, iz + cz),
                         f - Vec3{static_cast<double>(cx), static_cast<double>(cy), static_cast<double>(cz)});
        }
        return value;
    }

private:
    static double fade(double t) { return t * t * t * (t * (t * 6 - 15) + 10); }

    [[nodiscard]] Vec3 gradient(std::int32_t x, std::int32_t y, std::int32_t z) const {
        std::uint32_t h = static_cast<std::uint32_t>(x) * 0x8da6b343u ^
                          static_cast<std::uint32_t>(y) * 0xd8163841u ^
                          static_cast<std::uint32_t>(z) * 0xcb1ab31fu ^ key_[0] ^ layer_ * 0x9e3779b9u;
        h = mix(h);
        const std::uint32_t g = mix(h ^ key_[1]);
        const auto component = [](std::uint32_t bits) {
            return static_cast<double>(bits & 0x3ff) / 511.5 - 1;
        };
        return {component(g), component(g >> 10), component(g >> 20)};
    }

    static std::uint32_t mix(std::uint32_t x) {
        x ^= x >> 16;
        x *= 0x7feb352du;
        x ^= x >> 15;
        x *= 0x846ca68bu;
        return x ^ x >> 16;
    }

    std::array<std::uint32_t, 2> key_;
    std::uint32_t layer_;
};

struct Crater {
    Vec3 centre; ///< unit vector
    double radius = 0;
    double freshness = 1;
};

double smooth_step(double t) {
    t = std::clamp(t, 0.0, 1.0);
    return t * t * (3 - 2 * t);
}

/// Height of a crater of radius 1 at distance `x` from its centre, in crater diameters: a parabolic bowl, a
/// rim at x = 1 and an ejecta blanket that falls off as x^-3 and ends at 2.
double crater_height(double x) {
    constexpr double depth = 0.15;
    constexpr double rim = 0.03;
    if (x >= 2) return 0;
    const double bowl = (depth + rim) * (x * x) - depth;
    const double blanket = rim / (x * x * x + 1e-9) * smooth_step(2 - x);
    // A rounded rim where the two meet.
    const double blend = smooth_step((x - 0.9) / 0.2);
    return x < 0.9 ? bowl : std::min(bowl, rim) * (1 - blend) + std::min(blanket, rim) * blend;
}

std::vector<Crater> make_craters(std::uint64_t seed) {
    constexpr std::uint32_t count = 420;
    std::vector<Crater> craters;
    for (std::uint32_t i = 0; i < count; ++i) {
        const auto w = philox4x32({i, 0, 0, 0x63726174}, philox_key(seed));
        // Uniform on the sphere by rejection, so that no libm call decides where a crater lies.
        Vec3 p;
        for (std::uint32_t attempt = 1;; ++attempt) {
            const auto q = philox4x32({i, attempt, 0, 0x63726174}, philox_key(seed));
            p = {2 * uniform_double(q[0]) - 1, 2 * uniform_double(q[1]) - 1, 2 * uniform_double(q[2]) - 1};
            const double n = length_squared(p);
            if (n <= 1 && n > 0.01) break;
        }
        // Cumulative number ~ radius^-2: the rank alone gives the size, the hash some spread.
        const double rank = (i + 0.5 + uniform_double(w[0])) / count;
        const double radius = std::min(0.42, 0.030 / std::sqrt(rank) * (0.8 + 0.4 * uniform_double(w[1])));
        craters.push_back({normalized(p), radius, 0.35 + 0.65 * uniform_double(w[2])});
    }
    // Large ones first: the small ones came later and lie on top.
    std::stable_sort(craters.begin(), craters.end(),
                     [](const Crater& a, const Crater& b) { return a.radius > b.radius; });
    return craters;
}

} // namespace

TriangleMesh make_icosphere(std::uint32_t subdivisions) {
    const double phi = (1 + std::sqrt(5.0)) / 2;
    std::vector<Vec3> points;
    for (const double a : {-1.0, 1.0})
        for (const double b : {-phi, phi}) {
            points.push_back({0, a, b});
            points.push_back({a, b, 0});
            points.push_back({b, 0, a});
        }
    for (Vec3& p : points)
        p = normalized(p);
    std::vector<std::array<std::uint32_t, 3>> triangles;
    // Faces of the icosahedron: all triples at mutual edge length, wound outwards.
    const double edge2 = 1.2; // edge^2 = 1.1056 on the unit sphere, the next distance^2 is 2.89
    for (std::uint32_t i = 0; i < 12; ++i)
        for (std::uint32_t j = i + 1; j < 12; ++j)
            for (std::uint32_t k = j + 1; k < 12; ++k) {
                if (length_squared(points[i] - points[j]) > edge2 ||
                    length_squared(points[j] - points[k]) > edge2 ||
                    length_squared(points[i] - points[k]) > edge2)
                    continue;
                const bool outward = dot(cross(points[j] - points[i], points[k] - points[i]), points[i]) > 0;
                triangles.push_back(outward ? std::array{i, j, k} : std::array{i, k, j});
            }
    for (std::uint32_t level = 0; level < subdivisions; ++level) {
        std::unordered_map<std::uint64_t, std::uint32_t> middles;
        middles.reserve(triangles.size() * 3 / 2);
        const auto middle = [&](std::uint32_t a, std::uint32_t b) {
            const std::uint64_t key = std::uint64_t{std::min(a, b)} << 32 | std::max(a, b);
            const auto [it, fresh] = middles.try_emplace(key, static_cast<std::uint32_t>(points.size()));
            if (fresh) points.push_back(normalized(points[a] + points[b]));
            return it->second;
        };
        std::vector<std::array<std::uint32_t, 3>> finer;
        finer.reserve(triangles.size() * 4);
        for (const auto& [a, b, c] : triangles) {
            const std::uint32_t ab = middle(a, b);
            const std::uint32_t bc = middle(b, c);
            const std::uint32_t ca = middle(c, a);
            finer.push_back({a, ab, ca});
            finer.push_back({ab, b, bc});
            finer.push_back({ca, bc, c});
            finer.push_back({ab, bc, ca});
        }
        triangles = std::move(finer);
    }
    TriangleMesh mesh;
    mesh.triangles = std::move(triangles);
    mesh.vertices.reserve(points.size());
    for (const Vec3 p : points)
        mesh.vertices.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
    return mesh;
}

scene::ParameterList declare(ProceduralBodyParameters& p) {
    return {
        config::key("mean_radius_m", &p.mean_radius_m)
            .unit("m")
            .range(1e-3, 1e9)
            .required()
            .help("Mean radius of the procedural body"),
        config::key("axis_ratios", &p.axis_ratios)
            .range(0.1, 10)
            .help("Proportions of the axes of the procedural body, x, y and z"),
        config::key("seed", &p.seed)
            .range(0, 9e15)
            .help("Seed of the noise and of the craters: the same seed gives the same body"),
        config::key("subdivisions", &p.subdivisions)
            .range(0, 9)
            .help("Fineness n of the procedural body: it has 20 * 4^n facets"),
    };
}

std::shared_ptr<const Shape> make(const ProceduralBodyParameters& p, ShapeContext& context) {
    return context.mesh_shape(make_procedural_body(p));
}

TriangleMesh make_procedural_body(const ProceduralBodyParameters& d) {
    ProceduralBodyParameters checked = d;
    scene::check_ranges(scene::keys_of(declare(checked)), "procedural body");

    TriangleMesh mesh = make_icosphere(d.subdivisions);
    const std::vector<Crater> craters = make_craters(d.seed);
    const Noise lumps(d.seed, 1);
    const Noise relief(d.seed, 2);
    const Noise ridges(d.seed, 3);
    const Noise outline(d.seed, 4);
    // The axes are ratios; their geometric mean becomes the mean radius.
    const double mean = std::cbrt(d.axis_ratios.x * d.axis_ratios.y * d.axis_ratios.z);
    const Vec3 axes = d.axis_ratios * (d.mean_radius_m / mean);

    for (Vec3f& vertex : mesh.vertices) {
        const Vec3 n = normalized(to_double(vertex));
        // The overall shape: two octaves of broad lumps, as of a rubble pile.
        double height =
            0.20 * lumps(1.1 * n + Vec3{7.3, 1.9, 4.1}) + 0.10 * lumps(2.3 * n + Vec3{1.7, 9.2, 2.8});
        // Rims are not circles: the distance to a crater's centre is warped by noise.
        const double warp = 1 + 0.18 * outline(5.0 * n) + 0.12 * outline(13.0 * n) + 0.08 * outline(31.0 * n);
        for (const Crater& crater : craters) {
            const double distance2 = length_squared(n - crater.centre) * warp * warp;
            const double reach = 2 * crater.radius;
            if (distance2 >= reach * reach) continue;
            const double x = std::sqrt(distance2) / crater.radius;
            height += 2 * crater.radius * crater.freshness * crater_height(x);
        }
        // Fractal relief, seven octaves with a fall-off between that of Brownian surfaces and pink noise;
        // ridged octaves give the broken look.
        double amplitude = 0.034;
        double frequency = 4.7;
        for (int octave = 0; octave < 7; ++octave) {
            const Vec3 p = frequency * n + Vec3{3.1, 5.7, 8.9} * (octave + 1.0);
            height += amplitude * (0.7 * relief(p) + 0.3 * (0.35 - std::abs(ridges(p))));
            amplitude *= 0.52;
            frequency *= 2.03;
        }
        const double r = std::max(0.2, 1 + height);
        vertex = {static_cast<float>(n.x * axes.x * r), static_cast<float>(n.y * axes.y * r),
                  static_cast<float>(n.z * axes.z * r)};
    }
    complete_normals(mesh, 180);
    return mesh;
}

} // namespace obscura::renderer
