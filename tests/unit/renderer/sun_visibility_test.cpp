// SPDX-License-Identifier: Apache-2.0
// Visibility of the Sun kept with the tiles of a terrain: against a shadow's known length, and images of it
// against those with shadow rays and many samples.
#include "renderer/materials/lambert.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "renderer/planets/sun_lookup.hpp"
#include "renderer/planets/sun_visibility.hpp"
#include "support.hpp"
#include "terrain_support.hpp"

#include <algorithm>
#include <cmath>

namespace sun_visibility_test {

using namespace obscura;
using namespace obscura::test;

namespace {

constexpr double degree = std::numbers::pi / 180;

/// A plane of 2.56 km, cells of 10 m in its only tile, with a ridge along y at x = 0.
constexpr double half_edge_m = 1280, ridge_m = 100, foot_m = 150;
double ridge(Vec3 p) {
    return ridge_m * std::max(0.0, 1 - std::abs(p.x) / foot_m);
}

/// What is kept of the plane's tile with the Sun at an elevation above the direction of +x.
const SunTile& ridge_tile(const TerrainShape& shape, double elevation) {
    SurfaceNode& root = *shape.tiles()->root(0);
    const Vec3 sun_m = astronomical_unit_m * Vec3{std::cos(elevation), 0, std::sin(elevation)};
    // As from a point on the ridge, small enough to have no penumbra.
    REQUIRE(shape.tiles()->sun_visibility()->make(root, {sun_m, 1}, true));
    return *root.sun.load();
}

/// The mean about a place of a tile, looked up in a lane of its own beside others without a tile.
Vec3 mean_at(const SunTile& tile, double x, double y, double width) {
    SunLookups lookups{};
    const auto lane = static_cast<int>(x) % packet_size;
    lookups.tile[static_cast<std::size_t>(lane)] = &tile;
    lookups.x[lane] = x;
    lookups.y[lane] = y;
    lookups.width[lane] = width;
    Vec3s mean;
    sun_means(lookups, mean);
    CHECK(length(mean.lane((lane + 1) % packet_size)) == 0);
    return mean.lane(lane);
}

TerrainShape::Settings with_sun() {
    TerrainShape::Settings settings = at_level(0);
    settings.tiles.sun_visibility = true;
    return settings;
}

/// A Moon of noise from 500 km, 64 x 64 pixels of a kilometre.
scene::Scene rough_moon(double elevation, renderer::SunVisibilityKind kind) {
    scene::Scene s;
    renderer::PlanetParameters planet;
    planet.radii_m = {1737400, 1737400, 1737400};
    planet.relief.detail.terrain = renderer::DetailTerrain::highlands;
    planet.relief.sun_visibility = kind;
    s.bodies.push_back({"moon", planet, renderer::LambertParameters{0.12}, {}});
    s.sun.position_m = astronomical_unit_m * Vec3{std::sin(elevation), std::cos(elevation), 0};
    s.camera = camera_at({1737400 + 500e3, 0, 0}, 64, 0.002);
    s.camera.psf_sigma_px = 0.7;
    return s;
}

/// Root mean square difference over the mean of `truth`.
double error(const Image& image, const Image& truth) {
    double squares = 0;
    for (std::size_t k = 0; k < truth.values.size(); ++k) {
        const double d = static_cast<double>(image.values[k]) - static_cast<double>(truth.values[k]);
        squares += d * d;
    }
    const auto count = static_cast<double>(truth.values.size());
    return std::sqrt(squares / count) / (truth.sum() / count);
}

} // namespace

TEST_CASE("A ridge's shadow is as long as its height says, in every mip level") {
    const TerrainShape shape(terrain::SurfaceDomain::plane(half_edge_m), layers_of(ridge, 0, ridge_m),
                             with_sun());
    const SurfaceTiles::Pin pin = shape.tiles()->pin();
    for (const double elevation : {8 * degree, 15 * degree, 25 * degree}) {
        const SunTile& kept = ridge_tile(shape, elevation);
        // Dark from the ridge on, its own far side and the ground as far as h / tan e.
        const double dark_m = ridge_m / std::tan(elevation);
        CAPTURE(elevation, dark_m);
        CHECK(dark_m > foot_m);
        // Light on a horizontal receiver over the tile: the ground that is lit, and the near side.
        const double slope = ridge_m / foot_m, along = 1 / std::hypot(1, slope);
        const double level_m = 2 * half_edge_m - dark_m - foot_m;
        const Vec3 wanted =
            (level_m * Vec3{0, 0, 1} + foot_m * along * Vec3{slope, 0, 1}) / (2 * half_edge_m);
        for (int level = SunTile::first_level; level <= SunTile::last_level; ++level) {
            Vec3 sum;
            const int edge = 1 << (SunTile::last_level - level);
            for (int k = 0; k < edge * edge; ++k)
                sum =
                    sum + SunTile::unpack(kept.texels[SunTile::offset(level) + static_cast<std::size_t>(k)]);
            const Vec3 mean = sum / (static_cast<double>(edge) * edge);
            CAPTURE(level, mean.x, mean.y, mean.z, wanted.x, wanted.z);
            CHECK(length(mean - wanted) < 0.005);
        }
        // Across the end of the shadow, within the three cells of a texel and its neighbour.
        const auto at = [&](double x_m) { return mean_at(kept, 128 + x_m / 10, 128, 1).z; };
        CHECK(at(-dark_m + 30) < 0.05);
        CHECK(at(-dark_m - 30) > 0.95);
    }
}

TEST_CASE("Look-ups are linear between texels and between levels") {
    SunTile tile;
    // Linear in place; levels of width w one step of x higher each.
    const auto value = [](double x, double y, double level) {
        return Vec3{x / 512 + 0.05 * level, y / 512, -x / 1024 - y / 1024};
    };
    for (int level = SunTile::first_level; level <= SunTile::last_level; ++level) {
        const int edge = 1 << (SunTile::last_level - level);
        const double width = std::ldexp(1.0, level);
        for (int j = 0; j < edge; ++j)
            for (int i = 0; i < edge; ++i)
                tile.texels[SunTile::offset(level) + static_cast<std::size_t>(j * edge + i)] =
                    SunTile::pack(value((i + 0.5) * width, (j + 0.5) * width, level));
    }
    Directions any;
    for (int k = 0; k < 5000; ++k) {
        const double width = std::exp2(9 * any.number());
        const int fine = std::clamp(static_cast<int>(std::log2(width)), 1, 7);
        const double share = std::clamp(std::ldexp(width, -fine) - 1, 0.0, 1.0);
        const auto at_level = [&](int level) {
            const double half = std::ldexp(0.5, level);
            return std::pair(half, 256 - half);
        };
        const double x = 256 * any.number(), y = 256 * any.number();
        const auto of = [&](int level) {
            const auto [least, most] = at_level(level);
            return value(std::clamp(x, least, most), std::clamp(y, least, most), level);
        };
        const Vec3 wanted = (1 - share) * of(fine) + share * of(fine + 1);
        CAPTURE(x, y, width, fine, share);
        REQUIRE(length(mean_at(tile, x, y, width) - wanted) < 2.0 / 511);
    }
}

TEST_CASE("Rays that are left out on the night side can meet nothing that sees the Sun") {
    const auto hills = [](Vec3 p) {
        return 20 * std::sin(p.x / 60) * std::sin(p.y / 50) * std::cos(p.z / 70);
    };
    TerrainShape::Settings settings = at_level(3);
    settings.tiles.sun_visibility = true;
    // Semi-axes that differ: the cone of darkness is one in scaled space only.
    const TerrainShape shape(terrain::SurfaceDomain::ellipsoid({1000, 950, 900}), layers_of(hills, -20, 20),
                             settings);
    const SurfaceTiles::Pin pin = shape.tiles()->pin();
    Directions any;
    int left_out = 0, night = 0;
    for (int k = 0; k < 3000; ++k) {
        const Vec3 sun_m = 2e6 * any(), origin = (1100 + 5000 * any.number()) * any();
        const double sun_radius_m = 2e6 * 0.0047;
        const Vec3 direction = normalized(900 * any.number() * any() - origin);
        const DetailView detail{.eye_m = origin, .cell_rad = 1e-3, .sun = {sun_m, sun_radius_m}};
        OneRay skipped(origin, direction, &detail), traced(origin, direction, &detail);
        skipped.rays.sunlight_only = true;
        shape.intersect(skipped.rays, 2, skipped.hits);
        shape.intersect(traced.rays, 2, traced.hits);
        const int lane = OneRay::lane;
        if (traced.hits.body[lane] != 2) {
            REQUIRE(skipped.hits.body[lane] == -1);
            continue;
        }
        const SurfacePacket surface = traced.surface(shape);
        const Vec3 place = surface.shadow_origin.lane(lane);
        night += dot(place, sun_m) < -0.3 * length(place) * length(sun_m) ? 1 : 0;
        REQUIRE(skipped.hits.body[lane] == 2);
        if (skipped.hits.u[lane] >= 0) {
            CHECK(skipped.hits.t[lane] == traced.hits.t[lane]);
            continue;
        }
        ++left_out;
        CHECK(std::abs(skipped.hits.t[lane] - traced.hits.t[lane]) < 2000);
        SunlitPacket lit;
        REQUIRE(shape.sunlit(skipped.rays, skipped.hits, 2, {}, lit));
        CHECK(lit.known.on[lane] == -1);
        CHECK(lit.visible[lane] == 0);
        // Towards the edge of the disc all around.
        const Vec3 to_sun = sun_m - place, across = normalized(cross(to_sun, {0.3, 0.5, 0.8}));
        const Vec3 other = normalized(cross(to_sun, across));
        for (int edge = 0; edge < 8; ++edge) {
            const double turn = edge * 45 * degree;
            const Vec3 point = to_sun + sun_radius_m * (std::cos(turn) * across + std::sin(turn) * other);
            RayPacket shadow = OneRay(place, normalized(point), &detail).rays;
            shape.occlude(shadow);
            REQUIRE(shadow.active.on[lane] == 0);
        }
    }
    CHECK(night > 300);
    CHECK(left_out > night / 2);
}

TEST_CASE("Packed normals are right to half a step") {
    Directions any;
    for (int k = 0; k < 1000; ++k) {
        const Vec3 n = any.number() * any();
        const Vec3 back = SunTile::unpack(SunTile::pack(n));
        CHECK(std::max({std::abs(back.x - n.x), std::abs(back.y - n.y), std::abs(back.z - n.z)}) <=
              0.50001 / 511);
    }
}

TEST_CASE("The Sun that visibility is kept for is near the true one and moves by steps") {
    Directions any;
    for (int k = 0; k < 1000; ++k) {
        const Vec3 sun_m = (0.5 + any.number()) * astronomical_unit_m * any();
        const SunSeen seen = rounded_sun(sun_m, 7e8);
        const double angle = length(normalized(seen.centre_m) - normalized(sun_m));
        CHECK(angle < 0.71 * sun_step_rad);
        CHECK(std::abs(length(seen.centre_m) / length(sun_m) - 1) < 0.006);
        CHECK(length(rounded_sun(seen.centre_m, 7e8).centre_m - seen.centre_m) <
              1e-12 * length(seen.centre_m));
        // Half a degree on, it is another one.
        const Vec3 moved = sun_m + 0.01 * length(sun_m) * normalized(cross(sun_m, {1, 2, 3}));
        CHECK_FALSE(rounded_sun(moved, 7e8) == seen);
    }
}

TEST_CASE("Kept visibility gives the image of shadow rays and many samples") {
    using renderer::SunVisibilityKind;
    for (const double elevation : {30 * degree, 8 * degree}) {
        const Image truth =
            render(renderer::Renderer(rough_moon(elevation, SunVisibilityKind::traced), {256, 2, 3}));
        renderer::RenderSettings one{1, 2, 3};
        one.target_error = 0.05;
        const double kept =
            error(render(renderer::Renderer(rough_moon(elevation, SunVisibilityKind::tiles), one)), truth);
        const double traced =
            error(render(renderer::Renderer(rough_moon(elevation, SunVisibilityKind::traced), one)), truth);
        CAPTURE(elevation, kept, traced);
        CHECK(kept < (elevation > 0.3 ? 0.02 : 0.055));
        CHECK(kept < 0.5 * traced);
    }
}

} // namespace sun_visibility_test
