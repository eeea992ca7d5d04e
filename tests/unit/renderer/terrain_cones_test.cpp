// SPDX-License-Identifier: Apache-2.0
// Cones of tiles: nothing of the tile is in them, and shadow rays that they let through are not blocked.
#include "renderer/planets/terrain_shape.hpp"
#include "renderer/planets/tile_cones.hpp"
#include "terrain/cube_sphere.hpp"
#include "terrain_support.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <vector>

namespace terrain_cones_test {

using namespace obscura;
using namespace obscura::test;
using terrain::SurfaceDomain;

namespace {

double hills_m(Vec3 p) {
    return 20 * std::sin(0.013 * p.x) * std::cos(0.011 * p.y - 0.009 * p.z) +
           0.3 * std::sin(0.9 * p.x + 0.7 * p.z);
}

} // namespace

TEST_CASE("No point of a tile rises faster from a node than the node's cone says") {
    const bool plane = GENERATE(false, true);
    const SurfaceDomain domain =
        plane ? SurfaceDomain::plane(1000) : SurfaceDomain::ellipsoid({1000, 800, 600});
    const TerrainShape shape(domain, layers_of(hills_m, -30, 30));
    const SurfaceTiles& tiles = *shape.tiles();
    Directions any;
    int wrong = 0;
    double tightest = 0;
    std::map<int, int> codes;
    for (int chain = 0; chain < 6; ++chain) {
        SurfaceNode* node = tiles.root(plane ? 0 : static_cast<std::size_t>(chain));
        for (int level = 0; level < 5; ++level) {
            const auto place = [&](int i, int j) {
                const double u = SurfaceDomain::coordinate(level, node->tile.key.i, i),
                             v = SurfaceDomain::coordinate(level, node->tile.key.j, j);
                return plane
                           ? Vec3{u, v, 0}
                           : normalized(terrain::cube_point(terrain::cube_faces[node->tile.key.face], u, v));
            };
            const auto number = [&](int last) { return static_cast<int>(any.number() * last); };
            for (int k = 0; k < 4000; ++k) {
                const int i = number(255), j = number(255);
                // Near ones, and any.
                const int reach = k % 2 == 0 ? 12 : 257;
                const int qi = std::clamp(k % 2 == 0 ? i + number(reach) - 6 : number(reach), 0, 256),
                          qj = std::clamp(k % 2 == 0 ? j + number(reach) - 6 : number(reach), 0, 256);
                if (qi == i && qj == j) continue;
                const Vec3 p = place(i, j), q = place(qi, qj);
                const double away = plane ? length(p - q) : 2 * std::asin(length(p - q) / 2);
                const double rise =
                    (node->tile.height_m(qi, qj) - node->tile.height_m(i, j)) / domain.unit_m() / away;
                // The ring that holds the second vertex; on the border of nodes, that of either.
                const auto ring = [&](int to_i, int to_j) {
                    const auto apart = [](int a, int b, int at) { return std::abs((a >> at) - (b >> at)); };
                    for (std::size_t r = 0; r < cone_rings.size(); ++r)
                        if (std::max(apart(i, to_i, cone_rings[r]), apart(j, to_j, cone_rings[r])) <= 1)
                            return r;
                    return cone_rings.size();
                };
                const std::size_t quadrant = (qi > i ? 1u : 0u) | (qj > j ? 2u : 0u);
                const std::uint8_t code =
                    node->cones
                        .rise[static_cast<std::size_t>(j / 8) * cone_edge + static_cast<std::size_t>(i / 8)]
                             [quadrant][ring(std::min(qi, 255), std::min(qj, 255))];
                ++codes[code];
                const double cone = code == steepest_rise
                                        ? std::numeric_limits<double>::infinity()
                                        : std::bit_cast<double>((rise_base + code) << rise_shift);
                wrong += rise > cone ? 1 : 0;
                tightest = std::max(tightest, rise / cone);
            }
            node = tiles.make_child(*node, static_cast<unsigned>(4 * any.number()));
        }
    }
    CHECK(wrong == 0);
    CHECK(tightest > 0.8);
    CHECK(codes.size() > 20);
}

TEST_CASE("Rays from the ground are blocked where they meet something, whatever their elevation") {
    const bool plane = GENERATE(false, true);
    const SurfaceDomain domain =
        plane ? SurfaceDomain::plane(1000) : SurfaceDomain::ellipsoid({1000, 800, 600});
    TerrainShape::Settings settings;
    settings.fixed_level = 3;
    const TerrainShape shape(domain, layers_of(hills_m, -30, 30), settings);
    const SurfaceTiles::Pin pin = shape.tiles()->pin();
    Directions any;
    int blocked = 0, clear = 0;
    for (int k = 0; k < 6000; ++k) {
        const Vec3 from =
            plane ? Vec3{2000 * any.number() - 1000, 2000 * any.number() - 1000, 500} : 2000 * any();
        const Vec3 down = plane ? Vec3{0, 0, -1} : normalized(-from);
        OneRay first(from, down);
        const double t = first.meet(shape);
        if (t == no_hit) continue;
        const SurfacePacket surface = first.surface(shape);
        const Vec3 origin = surface.shadow_origin.lane(OneRay::lane);
        Vec3 east, north;
        orthonormal_basis(-down, east, north);
        const double elevation = std::numbers::pi / 2 * any.number() * any.number();
        const double azimuth = 2 * std::numbers::pi * any.number();
        const Vec3 direction = std::sin(elevation) * -down +
                               std::cos(elevation) * (std::cos(azimuth) * east + std::sin(azimuth) * north);
        INFO("ray " << k << ", elevation " << elevation);
        // Compares both: cones serve shadow rays alone.
        (distance_to(shape, origin, direction) == no_hit ? clear : blocked) += 1;
    }
    CHECK(blocked > 300);
    CHECK(clear > 1500);
}

TEST_CASE("Cones change no byte of a picture with shadows") {
    const bool plane = GENERATE(false, true);
    const double sun_elevation = GENERATE(1.5, 8.0, 30.0) * std::numbers::pi / 180;
    const SurfaceDomain domain =
        plane ? SurfaceDomain::plane(1000) : SurfaceDomain::ellipsoid({1000, 1000, 1000});
    const TerrainShape shape(domain, layers_of(hills_m, -30, 30));
    const SurfaceTiles& tiles = *shape.tiles();
    const SurfaceTiles::Pin pin = tiles.pin();
    const Vec3 up = plane ? Vec3{0, 0, 1} : normalized(Vec3{0.3, -0.8, 0.5});
    const Vec3 eye = plane ? Vec3{100, 200, 300} : 1300 * up;
    Vec3 east, north;
    orthonormal_basis(up, east, north);
    const DetailView detail{.eye_m = eye, .cell_rad = 0.01};
    const Vec3 sun =
        std::sin(sun_elevation) * up + std::cos(sun_elevation) * normalized(Vec3{0.6 * east + 0.8 * north});
    int dark = 0;
    // Irradiance of 64 x 64 pixels under a distant Sun.
    const auto picture = [&] {
        std::vector<double> pixels;
        dark = 0;
        for (int y = 0; y < 64; y += 4)
            for (int x = 0; x < 64; x += 4) {
                RayPacket rays;
                HitPacket hits;
                hits.clear();
                for (int i = 0; i < packet_size; ++i) {
                    const double u = 0.6 * ((x + i % 4 + 0.5) / 32 - 1),
                                 v = 0.6 * ((y + i / 4 + 0.5) / 32 - 1);
                    rays.origin.set(i, eye);
                    rays.direction.set(i, normalized(u * east + v * north - up));
                    rays.t_max[i] = no_hit;
                    rays.active.on[i] = -1;
                    rays.level_u[i] = std::fmod(0.618 * (x + i % 4 + 7.3 * (y + i / 4)), 1.0);
                }
                rays.detail = &detail;
                shape.intersect(rays, 0, hits);
                SurfacePacket surface;
                shape.surface(rays, hits, 0, surface);
                RayPacket shadow = rays;
                shadow.origin = surface.shadow_origin;
                for (int i = 0; i < packet_size; ++i) {
                    shadow.direction.set(i, sun);
                    shadow.active.on[i] =
                        hits.body[i] == 0 && dot(surface.facet_normal.lane(i), sun) > 0 ? -1 : 0;
                }
                const Lanes faces = shadow.active;
                shape.occlude(shadow);
                for (int i = 0; i < packet_size; ++i) {
                    const bool lit = shadow.active.on[i] != 0;
                    dark += faces.on[i] != 0 && !lit ? 1 : 0;
                    pixels.push_back(lit ? dot(surface.normal.lane(i), sun) : 0);
                }
            }
        return pixels;
    };
    const std::vector<double> with = picture();
    const auto set_all = [&](std::uint8_t rise) {
        tiles.for_each([&](SurfaceNode& node) {
            for (auto& quadrants : node.cones.rise)
                for (TileCones::Rings& rings : quadrants)
                    rings.fill(rise);
        });
    };
    // None clears a ray.
    set_all(steepest_rise);
    CHECK(with == picture());
    CHECK(*std::max_element(with.begin(), with.end()) > 0);
    if (sun_elevation > 0.5) return;
    CHECK(dark > 40);
    // All clear all rays: they are what shadows come from.
    set_all(0);
    CHECK(with != picture());
}

} // namespace terrain_cones_test
