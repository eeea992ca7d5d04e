// SPDX-License-Identifier: Apache-2.0
// Cones of tiles: nothing of the tile is in them, and shadow rays that they let through are not blocked.
#include "renderer/planets/terrain_shape.hpp"
#include "renderer/planets/tile_cones.hpp"
#include "terrain/cube_sphere.hpp"
#include "terrain_support.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

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
                const int i = number(256), j = number(256);
                // Near ones, and any.
                const int reach = k % 2 == 0 ? 12 : 257;
                const int qi = std::clamp(k % 2 == 0 ? i + number(reach) - 6 : number(reach), 0, 256),
                          qj = std::clamp(k % 2 == 0 ? j + number(reach) - 6 : number(reach), 0, 256);
                if (qi == i && qj == j) continue;
                const Vec3 p = place(i, j), q = place(qi, qj);
                const double away = plane ? length(p - q) : 2 * std::asin(length(p - q) / 2);
                const double rise =
                    (node->tile.height_m(qi, qj) - node->tile.height_m(i, j)) / domain.unit_m() / away;
                const auto cone = static_cast<double>(
                    node->cones
                        .rise[static_cast<std::size_t>(j / 4) * cone_edge + static_cast<std::size_t>(i / 4)]);
                wrong += rise > cone ? 1 : 0;
                tightest = std::max(tightest, rise / cone);
            }
            node = tiles.make_child(*node, static_cast<unsigned>(4 * any.number()));
        }
    }
    CHECK(wrong == 0);
    CHECK(tightest > 0.5);
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
