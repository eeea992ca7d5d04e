// SPDX-License-Identifier: Apache-2.0
// Terrains of tiles: crossings against ellipsoids, closed forms, marching over all cells and Embree; borders,
// normals, levels of detail and arenas.
#include "renderer/shapes/ellipsoid.hpp"
#include "renderer/shapes/mesh_shape.hpp"
#include "support.hpp"
#include "terrain_march.hpp"
#include "terrain_support.hpp"

#include <hwy/targets.h>

#include <algorithm>
#include <map>

namespace terrain_tiles_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;
using terrain::SurfaceDomain;

namespace {

constexpr double degree = std::numbers::pi / 180;

TerrainShape waves_at(int level, std::uint64_t arena_bytes = std::uint64_t{512} << 20) {
    return {SurfaceDomain::ellipsoid({1000, 1000, 1000}), layers_of(waves_m, -waves_most_m, waves_most_m),
            at_level(level, arena_bytes)};
}

} // namespace

TEST_CASE("A terrain without relief is its ellipsoid, from two metres to an astronomical unit") {
    const Vec3 radii{1829400, 1819300, 1815700};
    const TerrainShape shape(SurfaceDomain::ellipsoid(radii), {});
    const Ellipsoid ellipsoid(EllipsoidParameters{radii});
    Directions any;
    for (const double altitude_m : {2.0, 1e3, 1e6, 1e9, 1.5e11})
        for (int k = 0; k < 200; ++k) {
            const Vec3 up = any();
            const Vec3 base{up.x * radii.x, up.y * radii.y, up.z * radii.z};
            const Vec3 origin = (length(base) + altitude_m) * normalized(base);
            const Vec3 aim = any();
            const Vec3 target =
                0.999 * std::cbrt(any.number()) * Vec3{aim.x * radii.x, aim.y * radii.y, aim.z * radii.z};
            const Vec3 direction = normalized(target - origin);
            const double wanted = distance_to(ellipsoid, origin, direction);
            REQUIRE(wanted < no_hit);
            // At grazing incidence the rounding of the direction alone moves the crossing.
            const double tolerance = std::max(1e-3, 1e-13 * altitude_m);
            REQUIRE_THAT(distance_to(shape, origin, direction), WithinAbs(wanted, tolerance));
            if (k % 20 != 0) continue;
            const DetailView detail{.eye_m = origin, .cell_rad = 1e-3};
            const SurfaceTiles::Pin pin = shape.tiles()->pin();
            REQUIRE_THAT(distance_to(shape, origin, direction, &detail, any.number()),
                         WithinAbs(wanted, tolerance));
        }
}

TEST_CASE("A ray meets a terrain where marching over all cells in long double does") {
    const int level = GENERATE(0, 1);
    const TerrainShape shape = waves_at(level);
    const March march(shape, level);
    Directions any;
    int met = 0;
    for (int k = 0; k < 250; ++k) {
        // One in four grazes the relief from low above it.
        const Vec3 up = any();
        const Vec3 origin = k % 4 == 0 ? 1.075 * up : up * (1.08 + 3 * any.number());
        const Vec3 direction = normalized(any() * (1.06 * any.number()) - origin);
        constexpr double reach = 1.08;
        const double along = -dot(origin, direction);
        const double half2 = reach * reach - length_squared(origin + along * direction);
        double wanted = no_hit;
        if (half2 > 0)
            wanted = march.first(origin, direction, std::max(0.0, along - std::sqrt(half2)),
                                 along + std::sqrt(half2));
        const double got = distance_to(shape, 1000 * origin, direction);
        INFO("ray " << k);
        if (wanted == no_hit) {
            REQUIRE(got == no_hit);
            continue;
        }
        ++met;
        REQUIRE_THAT(got, WithinAbs(1000 * wanted, 1e-5));
    }
    CHECK(met > 150);
}

TEST_CASE("Nothing slips through the borders of cells, tiles, levels and faces") {
    const TerrainShape shape(SurfaceDomain::ellipsoid({1000, 1000, 1000}), layers_of(rough_m, -80, 80));
    // The eye is so near that tiles of several levels meet.
    const Vec3 eye = 1090 * normalized(Vec3{1, 0.95, 0.9});
    const DetailView detail{.eye_m = eye, .cell_rad = 0.02};
    const SurfaceTiles::Pin pin = shape.tiles()->pin();
    Directions any;
    int escaped = 0;
    std::map<int, int> levels;
    for (int k = 0; k < 40000; ++k) {
        const terrain::CubeFace& face = terrain::cube_faces[static_cast<std::size_t>(k) % 6];
        const int level = k / 6 % 5;
        const double lattice = terrain::tile_cells << level;
        const auto on_lattice = [&] { return std::round(lattice * any.number()) / lattice * 2 - 1; };
        // Towards vertices, tile corners and along border planes; half of them near the eye.
        Vec3 aim = normalized(
            terrain::cube_point(face, on_lattice(), k % 8 < 4 ? on_lattice() : 2 * any.number() - 1));
        if (k % 16 == 1)
            aim = normalized(terrain::cube_point(face, k % 32 < 16 ? 1 : std::round(4 * any.number()) / 2 - 1,
                                                 2 * any.number() - 1));
        if (k % 2 == 0) aim = normalized(eye / 1000 + 0.2 * any());
        const double u = any.number();
        const Vec3 outside = 3000 * any();
        OneRay inwards(2000 * aim, -aim, &detail, u);
        escaped += inwards.meet(shape) == no_hit ? 1 : 0;
        if (inwards.hits.body[OneRay::lane] >= 0)
            ++levels[shape.tiles()->in_slot(inwards.hits.primitive[OneRay::lane] >> 16).tile.key.level];
        escaped += distance_to(shape, outside, normalized(850 * aim - outside), &detail, u) == no_hit ? 1 : 0;
        escaped += distance_to(shape, {0, 0, 0}, aim, &detail, u) == no_hit ? 1 : 0;
        const Vec3 within = 850 * any.number() * any();
        escaped += distance_to(shape, within, normalized(1000 * aim - within), &detail, u) == no_hit ? 1 : 0;
    }
    CHECK(escaped == 0);
    CHECK(levels.size() >= 4);
}

TEST_CASE("The cells of a terrain are as small as its view asks for, and not much smaller") {
    const TerrainShape shape(SurfaceDomain::ellipsoid({1000, 1000, 1000}), layers_of(rough_m, -80, 80));
    const SurfaceTiles::Pin pin = shape.tiles()->pin();
    Directions any;
    const Vec3 eye = 1100 * normalized(Vec3{1, 2, 3});
    DetailCounts counts;
    const DetailView detail{.eye_m = eye, .cell_rad = 0.01, .counts = &counts};
    double sum = 0;
    for (int k = 0; k < 4000; ++k) {
        OneRay ray(eye, normalized(900 * any.number() * any() - eye), &detail, any.number());
        const double t = ray.meet(shape);
        if (t == no_hit) continue;
        const SurfaceNode& node = shape.tiles()->in_slot(ray.hits.primitive[OneRay::lane] >> 16);
        // By the largest cell of the level, at the nearest point of the tile, on the reference surface.
        REQUIRE(node.spacing_m <= 0.01 * (t + 80) + 1e-9);
        sum += std::log2(node.spacing_m / (0.01 * t));
    }
    CHECK(counts.hits > 2000);
    CHECK(counts.coarser[0] == 0);
    const double mean = sum / static_cast<double>(counts.hits);
    CHECK(mean > -2.2);
    CHECK(mean < -0.5);
}

TEST_CASE("Crossings do not depend on the arena, nor on the order in which tiles are made") {
    const SurfaceDomain domain = SurfaceDomain::ellipsoid({1000, 1000, 1000});
    TerrainShape::Settings settings;
    const TerrainShape large(domain, layers_of(rough_m, -80, 80), settings);
    settings.tiles.arena_bytes = 48 * SurfaceTiles::slot_bytes();
    settings.tiles.pinned_levels = 1;
    const TerrainShape small(domain, layers_of(rough_m, -80, 80), settings);
    const DetailView detail{.eye_m = {700, 700, 500}, .cell_rad = 0.02};
    struct Ray {
        Vec3 origin, direction;
        double u, t;
    };
    Directions any;
    std::vector<Ray> rays;
    const SurfaceTiles::Pin pin = large.tiles()->pin();
    for (int k = 0; k < 1500; ++k) {
        const Vec3 origin = k % 2 == 0 ? detail.eye_m : 1100 * any();
        rays.push_back({origin, normalized(1000 * any.number() * any() - origin), any.number(), 0});
        rays.back().t = distance_to(large, origin, rays.back().direction, &detail, rays.back().u);
    }
    for (std::size_t k = rays.size(); k-- > 0;) {
        const SurfaceTiles::Pin short_pin = small.tiles()->pin();
        REQUIRE(distance_to(small, rays[k].origin, rays[k].direction, &detail, rays[k].u) == rays[k].t);
    }
    CHECK(large.tiles()->usage().made < 2978);
    CHECK(large.tiles()->usage().beyond == 0);
    // Tiles were thrown out and made again; no more than one ray needs were beyond the arena.
    CHECK(small.tiles()->usage().made > large.tiles()->usage().made);
    CHECK(small.tiles()->usage().tiles < large.tiles()->usage().tiles);
    CHECK(small.tiles()->usage().beyond <= 64);
}

TEST_CASE("Crossings are the same with all sets of vector instructions, alone and in packets") {
    const TerrainShape shape(SurfaceDomain::ellipsoid({1000, 900, 800}), layers_of(rough_m, -80, 80));
    const DetailView detail{.eye_m = {700, 700, 500}, .cell_rad = 0.02};
    const SurfaceTiles::Pin pin = shape.tiles()->pin();
    Directions any;
    std::vector<RayPacket> packets(60);
    for (RayPacket& rays : packets) {
        for (int i = 0; i < packet_size; ++i) {
            const Vec3 origin = i % 2 == 0 ? detail.eye_m : 1100 * any();
            rays.origin.set(i, origin);
            rays.direction.set(i, normalized(1000 * any.number() * any() - origin));
            rays.t_max[i] = no_hit;
            rays.active.on[i] = -1;
            rays.level_u[i] = any.number();
        }
        rays.detail = &detail;
    }
    std::vector<double> alone;
    for (const RayPacket& rays : packets)
        for (int i = 0; i < packet_size; ++i)
            alone.push_back(
                distance_to(shape, rays.origin.lane(i), rays.direction.lane(i), &detail, rays.level_u[i]));
    CHECK(std::count(alone.begin(), alone.end(), no_hit) < 900);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(target);
        INFO(hwy::TargetName(target));
        std::vector<double> together;
        for (const RayPacket& rays : packets) {
            HitPacket hits;
            hits.clear();
            shape.intersect(rays, 0, hits);
            together.insert(together.end(), hits.t.v, hits.t.v + packet_size);
        }
        CHECK(together == alone);
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST_CASE("Packets meet a terrain where single rays do that halve all parts of it") {
    const TerrainShape shape(SurfaceDomain::ellipsoid({1000, 900, 800}), layers_of(rough_m, -80, 80));
    const DetailView detail{.eye_m = {700, 700, 500}, .cell_rad = 0.02};
    const SurfaceTiles::Pin pin = shape.tiles()->pin();
    Directions any;
    int met = 0;
    for (int k = 0; k < 3000; ++k) {
        // One in three grazes, and one in three comes from an axis: u or v of the faces beside it, whose
        // planes all contain the axis, do not change along its way.
        const double far = k % 2 == 0 ? 2500 : -2500;
        const Vec3 axis = k % 9 == 1 ? Vec3{far, 0, 0} : k % 9 == 4 ? Vec3{0, far, 0} : Vec3{0, 0, far};
        const Vec3 origin = k % 3 == 0 ? 1085 * any() : k % 3 == 1 ? axis : 2500 * any();
        const Vec3 direction = normalized(1050 * any.number() * any() - origin);
        OneRay ray(origin, direction, &detail, any.number());
        const double got = ray.meet(shape);
        const auto scaled = [](Vec3 p) { return Vec3{p.x / 1000, p.y / 900, p.z / 800}; };
        const LevelChoice levels = shape.levels(ray.rays, OneRay::lane);
        const double wanted =
            TileTracer(*shape.tiles(), levels).first_crossing(scaled(origin), scaled(direction), no_hit).t;
        INFO("ray " << k);
        if (wanted == no_hit) {
            REQUIRE(got == no_hit);
        } else {
            REQUIRE_THAT(got, WithinAbs(wanted, 1e-8));
            ++met;
        }
    }
    CHECK(met > 1000);
}

TEST_CASE("No vertex is above the bounds of its tile, nor above those of the tiles over it") {
    const TerrainShape shape(SurfaceDomain::ellipsoid({1000, 800, 600}), layers_of(rough_m, -80, 80));
    const SurfaceTiles& tiles = *shape.tiles();
    Directions any;
    int wrong = 0;
    for (int chain = 0; chain < 12; ++chain) {
        SurfaceNode* node = tiles.root(static_cast<std::size_t>(chain % 6));
        for (int level = 1; level < 7; ++level) {
            const auto quarter = static_cast<unsigned>(4 * any.number());
            const double bound = node->child_highest[quarter];
            node = tiles.make_child(*node, quarter);
            wrong += node->own_highest > bound ? 1 : 0;
            const terrain::SurfaceTile& tile = node->tile;
            for (int k = 1; k <= terrain::pyramid_levels; ++k)
                for (int j = 0; j <= terrain::tile_cells; j += 3)
                    for (int i = 0; i <= terrain::tile_cells; i += 3) {
                        const auto ni = static_cast<std::uint32_t>(std::min(i, terrain::tile_cells - 1) >> k);
                        const auto nj = static_cast<std::uint32_t>(std::min(j, terrain::tile_cells - 1) >> k);
                        wrong += tile.height_m(i, j) > tile.maximum_m(k, ni, nj) ? 1 : 0;
                        if (i >> k > 0 && (i & ((1 << k) - 1)) == 0) // on the border of two nodes
                            wrong += tile.height_m(i, j) >
                                             tile.maximum_m(k, (static_cast<std::uint32_t>(i) >> k) - 1, nj)
                                         ? 1
                                         : 0;
                    }
        }
    }
    CHECK(wrong == 0);
    CHECK(tiles.usage().clamped == 0);
}

TEST_CASE("Vertices that tiles and faces share decode alike, and are the function's") {
    const TerrainShape shape(SurfaceDomain::ellipsoid({1000, 800, 600}), layers_of(rough_m, -80, 80));
    const SurfaceTiles& tiles = *shape.tiles();
    // By the position's own bits.
    std::map<std::array<double, 3>, double> heights;
    int differ = 0, shared = 0;
    double worst = 0;
    for (std::size_t face = 0; face < 6; ++face)
        for (unsigned quarter = 0; quarter < 4; ++quarter) {
            const SurfaceNode* node = tiles.make_child(*tiles.root(face), quarter);
            const terrain::TileKey key = node->tile.key;
            for (int j = -1; j <= terrain::tile_cells + 1; ++j)
                for (int i = -1; i <= terrain::tile_cells + 1; ++i) {
                    const bool border = i < 2 || j < 2 || i > 254 || j > 254;
                    // Corners of the margin are no vertex of a neighbour.
                    if (!border || ((i < 0 || i > 256) && (j < 0 || j > 256))) continue;
                    const Vec3 p = tiles.domain().point(key.face, SurfaceDomain::coordinate(1, key.i, i),
                                                        SurfaceDomain::coordinate(1, key.j, j));
                    const double h = node->tile.height_m(i, j);
                    worst = std::max(worst, std::abs(h * length(p) / 1000 - rough_m(p)));
                    const auto [at, fresh] = heights.try_emplace({p.x, p.y, p.z}, h);
                    shared += fresh ? 0 : 1;
                    differ += at->second != h ? 1 : 0;
                }
        }
    CHECK(differ == 0);
    CHECK(shared > 20000);
    CHECK(worst <= height_step_m(tiles.domain(), 1) / 2);
}

TEST_CASE("A terrain is the mesh of its points as Embree meets it") {
    constexpr std::uint32_t edge = 256 * 3;
    const TerrainShape shape = waves_at(0);
    TriangleMesh mesh;
    for (const terrain::CubeFace& face : terrain::cube_faces) {
        const auto first = static_cast<std::uint32_t>(mesh.vertices.size());
        const bool turned = dot(cross(terrain::cube_point(face, 1, 0) - terrain::cube_point(face, 0, 0),
                                      terrain::cube_point(face, 0, 1) - terrain::cube_point(face, 0, 0)),
                                terrain::cube_point(face, 0, 0)) < 0;
        const LevelChoice levels{};
        for (std::uint32_t j = 0; j <= edge; ++j)
            for (std::uint32_t i = 0; i <= edge; ++i) {
                const Vec3 q = normalized(terrain::cube_point(face, 2.0 * i / edge - 1, 2.0 * j / edge - 1));
                const Vec3 p = 1000 * (1 + TileTracer(*shape.tiles(), levels).below(q).t) * q;
                mesh.vertices.push_back(
                    {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
            }
        for (std::uint32_t j = 0; j < edge; ++j)
            for (std::uint32_t i = 0; i < edge; ++i) {
                const std::uint32_t a = first + j * (edge + 1) + i, b = a + 1, c = a + edge + 1, d = c + 1;
                mesh.triangles.push_back(turned ? std::array{a, c, b} : std::array{a, b, c});
                mesh.triangles.push_back(turned ? std::array{b, c, d} : std::array{b, d, c});
            }
    }
    const MeshShape facets(std::make_shared<const EmbreeDevice>(), mesh);
    Directions any;
    int differ = 0, met = 0;
    for (int k = 0; k < 20000; ++k) {
        const Vec3 origin = any() * 3000;
        const Vec3 direction = normalized(any() * (1080 * any.number()) - origin);
        const double wanted = distance_to(facets, origin, direction);
        const double got = distance_to(shape, origin, direction);
        met += wanted < no_hit ? 1 : 0;
        const bool same =
            (wanted == no_hit) == (got == no_hit) && (wanted == no_hit || std::abs(wanted - got) < 0.1);
        differ += same ? 0 : 1;
    }
    CHECK(met > 15000);
    CHECK(differ < 30); // at the limb
}

TEST_CASE("Normals are gradients of the patches, and continuous over cells, tiles and faces when smooth") {
    const TerrainShape shape = waves_at(1);
    Directions any;
    const LevelChoice levels{nullptr, 0, 1};
    const TileTracer tracer(*shape.tiles(), levels);
    double within_faces = 0, over_edges = 0;
    const auto smooth_at = [&](Vec3 q) {
        const TileCrossing at = tracer.below(q);
        return normalized(
            TileTracer::gradients(shape.tiles()->domain(), *at.node, at.cell, at.s, at.r).smooth);
    };
    for (int k = 0; k < 3000; ++k) {
        const Vec3 p0 = any();
        const TileCrossing at = tracer.below(p0);
        const Vec3 p = (1 + at.t) * p0;
        const auto above = [&](Vec3 q) { return length(q) - 1 - tracer.below(q).t; };
        constexpr double e = 1e-7;
        if (std::min({at.s, at.r, 1 - at.s, 1 - at.r}) > 1e-3) {
            const Vec3 wanted{(above(p + Vec3{e, 0, 0}) - above(p - Vec3{e, 0, 0})) / (2 * e),
                              (above(p + Vec3{0, e, 0}) - above(p - Vec3{0, e, 0})) / (2 * e),
                              (above(p + Vec3{0, 0, e}) - above(p - Vec3{0, 0, e})) / (2 * e)};
            const TileGradients got =
                TileTracer::gradients(shape.tiles()->domain(), *at.node, at.cell, at.s, at.r);
            REQUIRE(length(got.facet - wanted) < 1e-6);
        }
        // The smooth normal just over the border of a cell or tile, an edge of a face, a corner of the cube.
        const terrain::CubeFace& face = terrain::cube_faces[static_cast<std::size_t>(k) % 6];
        const int kind = k / 6 % 4;
        const double u = kind == 0   ? std::round(510 * any.number() + 1) / 256 - 1
                         : kind == 1 ? std::copysign(1, any.number() - 0.5)
                         : kind == 2 ? 0.0
                                     : std::copysign(1 - 1e-4, any.number() - 0.5);
        const double v = kind == 3 ? std::copysign(1, any.number() - 0.5) : 2 * any.number() - 1;
        const Vec3 border = terrain::cube_point(face, u, v);
        double& worst = kind % 2 == 0 ? within_faces : over_edges;
        for (const Vec3 aside : {Vec3{1, 0.1, 0.2}, Vec3{-0.3, 1, 0.1}, Vec3{0.2, 0.1, 1}})
            worst =
                std::max(worst, length(smooth_at(border + 1e-9 * aside) - smooth_at(border - 1e-9 * aside)));
    }
    CHECK(within_faces < 1e-6);
    CHECK(within_faces > 0);
    // At vertices they are the same; between them, components in two frames are interpolated.
    CHECK(over_edges < 4e-4);
    // They are the function's own but for the third derivatives.
    for (int k = 0; k < 300; ++k) {
        const Vec3 q = any();
        constexpr double e = 1e-5;
        const auto above = [&](Vec3 p) { return length(p) - 1 - waves_m(1000 * normalized(p)) / 1000; };
        const Vec3 p = q * (1 + waves_m(1000 * q) / 1000);
        const Vec3 wanted{(above(p + Vec3{e, 0, 0}) - above(p - Vec3{e, 0, 0})) / (2 * e),
                          (above(p + Vec3{0, e, 0}) - above(p - Vec3{0, e, 0})) / (2 * e),
                          (above(p + Vec3{0, 0, e}) - above(p - Vec3{0, 0, e})) / (2 * e)};
        REQUIRE(length(smooth_at(q) - normalized(wanted)) < 0.12);
    }
}

TEST_CASE("The shadow of a mountain ends where the Sun's ray over its top meets the sphere") {
    // One vertex of 2 km on the Moon's equator at longitude 0, all others 0.
    constexpr double radius_m = 1737400, top_m = 2000;
    const TerrainShape moon(
        SurfaceDomain::ellipsoid({radius_m, radius_m, radius_m}),
        layers_of([](Vec3 p) { return p.x > radius_m * (1 - 1e-9) ? top_m : 0.0; }, 0, top_m), at_level(1));
    for (const double elevation_deg : {2.0, 5.0, 15.0}) {
        // From the top along the meridian plane of the Sun: the angle at the centre at which the Sun's ray
        // that grazes the top reaches the sphere at that elevation.
        const double elevation = elevation_deg * degree;
        const double reach = std::acos(std::cos(elevation) * radius_m / (radius_m + top_m)) - elevation;
        for (const double share : {0.9, 0.99, 1.01, 1.1}) {
            const double angle = -share * reach;
            const Vec3 ground = radius_m * (1 + 1e-10) * Vec3{std::cos(angle), std::sin(angle), 0};
            // The Sun at that elevation at the end of the shadow, not at `ground`.
            const double at_end = -reach;
            const Vec3 up{std::cos(at_end), std::sin(at_end), 0},
                east{-std::sin(at_end), std::cos(at_end), 0};
            const Vec3 sun = std::sin(elevation) * up + std::cos(elevation) * east;
            INFO(elevation_deg << " deg, at " << share << " of the shadow");
            CHECK((distance_to(moon, ground, sun) < no_hit) == (share < 1));
        }
    }
}

TEST_CASE("A planar terrain of constant slope is a plane with walls at its sides") {
    constexpr double half_edge_m = 500;
    const auto height = [](Vec3 p) { return 0.25 * p.x - 0.5 * p.y + 10; };
    const TerrainShape shape(SurfaceDomain::plane(half_edge_m), layers_of(height, -400, 400));
    const SurfaceTiles::Pin pin = shape.tiles()->pin();
    Directions any;
    const DetailView detail{.eye_m = {0, 0, 450}, .cell_rad = 0.01};
    int met = 0;
    for (int k = 0; k < 2000; ++k) {
        const Vec3 origin{400 * (2 * any.number() - 1), 400 * (2 * any.number() - 1),
                          390 + 1e4 * any.number()};
        const Vec3 target{490 * (2 * any.number() - 1), 490 * (2 * any.number() - 1), 0};
        const Vec3 direction = normalized(Vec3{target.x, target.y, height(target)} - origin);
        // z - height = 0 along the ray.
        const double above = origin.z - height(origin);
        const double wanted = above / -(direction.z - 0.25 * direction.x + 0.5 * direction.y);
        const Vec3 at = origin + wanted * direction;
        if (std::max(std::abs(at.x), std::abs(at.y)) > half_edge_m || above < 0) continue;
        ++met;
        const DetailView* const view = k % 2 == 0 ? &detail : nullptr;
        OneRay ray(origin, direction, view, any.number());
        REQUIRE_THAT(ray.meet(shape), WithinAbs(wanted, 1e-6 + height_step_m(shape.tiles()->domain(), 0)));
        const Vec3 normal = ray.surface(shape).normal.lane(OneRay::lane);
        REQUIRE(length(normal - normalized(Vec3{-0.25, 0.5, 1})) < 1e-4);
    }
    CHECK(met > 500);
    // From beside it, the side is met; above it and beyond, nothing.
    CHECK_THAT(distance_to(shape, {1000, 0, 50}, {-1, 0, 0}), WithinAbs(500, 1e-9));
    CHECK(distance_to(shape, {1000, 0, 500}, {-1, 0, 0}) == no_hit);
    CHECK(distance_to(shape, {1000, 0, 500}, {0, 0, -1}) == no_hit);
    // From below, the way out.
    CHECK_THAT(distance_to(shape, {0, 0, -300}, {0, 0, 1}), WithinAbs(310, 1e-3));
}

} // namespace terrain_tiles_test
