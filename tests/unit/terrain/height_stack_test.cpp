// SPDX-License-Identifier: Apache-2.0
// Layers of rasters: feathers, holes, bounds, meanings of heights, overlaps, and what is refused.
#include "core/error.hpp"
#include "terrain/maps/height_stack.hpp"
#include "terrain/maps/memory_pyramid.hpp"
#include "terrain/tiles/tile_maker.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <random>
#include <span>
#include <vector>

namespace height_stack_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;
constexpr float no_data = std::numeric_limits<float>::quiet_NaN();

std::shared_ptr<const Raster> raster_of(const MapFrame& frame, const std::function<double(Vec3)>& f,
                                        const std::function<bool(std::int64_t, std::int64_t)>& hole = {}) {
    std::vector<float> samples;
    for (std::int64_t j = 0; j < frame.height(); ++j)
        for (std::int64_t i = 0; i < frame.width(); ++i)
            samples.push_back(hole && hole(i, j) ? no_data
                                                 : static_cast<float>(f(frame.position(
                                                       {static_cast<double>(i), static_cast<double>(j)}))));
    return std::make_shared<const Raster>(
        std::make_shared<const MemoryPyramid>(frame.width(), frame.height(), std::move(samples)), frame);
}

/// Planar raster of that many pixels about a middle.
MapFrame plane(std::int64_t samples, double pixel_m, double x_m = 0, double y_m = 0) {
    Projection projection;
    projection.kind = ProjectionKind::planar;
    const double half = 0.5 * static_cast<double>(samples) * pixel_m;
    return {
        projection, {x_m - half, pixel_m, 0, y_m + half, 0, -pixel_m}, Registration::pixel, samples, samples};
}

MapFrame global(std::int64_t height, double radius_m) {
    return MapFrame::by_edges(Projection::of_sphere(ProjectionKind::simple_cylindrical, radius_m),
                              Registration::pixel, 2 * height, height, 0, 360 * degree, 90 * degree,
                              -90 * degree);
}

double height(const std::vector<std::shared_ptr<const HeightLayer>>& layers, Vec3 p, double spacing_m = 0) {
    return heights_at(layers, {&p, 1}, spacing_m).front();
}

double flat(Vec3 /*p*/) {
    return 0;
}

} // namespace

TEST_CASE("A patch is blended over its feather, and nowhere jumps") {
    const SurfaceDomain domain = SurfaceDomain::plane(1000);
    std::vector<HeightSource> sources(2);
    sources[0] = {"base", {raster_of(plane(100, 20), [](Vec3 p) { return 0.1 * p.x; })}};
    sources[1] = {"patch", {raster_of(plane(100, 5, 100, 0), [](Vec3 p) { return 0.1 * p.x + 30; })}, 1, 50};
    const HeightStack stack = make_height_stack(domain, sources);
    REQUIRE(stack.layers.size() == 2);
    REQUIRE(stack.overlaps.size() == 1);
    CHECK_THAT(stack.overlaps[0].mean_m, WithinAbs(30, 1e-4));
    CHECK_THAT(stack.overlaps[0].rms_m, WithinAbs(30, 1e-4));
    // The patch reaches from x = -150 to 350; two pixels inside its edge the feather begins.
    CHECK_THAT(height(stack.layers, {-150.5, 0, 0}), WithinAbs(-15.05, 1e-4));
    CHECK_THAT(height(stack.layers, {-140, 0, 0}), WithinAbs(-14, 1e-4));
    CHECK_THAT(height(stack.layers, {-90, 0, 0}), WithinAbs(21, 1e-3));
    CHECK_THAT(height(stack.layers, {-115, 0, 0}), WithinAbs(-11.5 + 15, 1e-3)); // half way
    const double quarter = 0.25 * 0.25 * (3 - 0.5);
    CHECK_THAT(height(stack.layers, {-127.5, 10, 0}), WithinAbs(-12.75 + 30 * quarter, 1e-3));
    // Steps of a centimetre: a smoothstep of 30 m over 50 m rises by up to 0.9 per metre.
    for (double x = -200, before = height(stack.layers, {x, 3, 0}); x < 400; x += 0.01) {
        const double now = height(stack.layers, {x, 3, 0});
        REQUIRE_THAT(now - before, WithinAbs(0, 0.0101));
        before = now;
    }
    // The spacing of samples goes over likewise.
    std::vector<double> heights(2), spacings(2, std::numeric_limits<double>::infinity());
    const std::vector<Vec3> at{{-500, 0, 0}, {100, 0, 0}};
    VertexGrid grid;
    grid.positions_m = at;
    grid.cap = {{0, 0, 0}, 1000};
    for (const auto& layer : stack.layers)
        layer->apply(grid, heights, spacings);
    CHECK_THAT(spacings[0], WithinAbs(20, 1e-9));
    CHECK_THAT(spacings[1], WithinAbs(5, 1e-9));
}

TEST_CASE("Sources are stacked by priority, and fitted by their offset if that is asked for") {
    const SurfaceDomain domain = SurfaceDomain::plane(100);
    const auto constant = [](double value) { return [value](Vec3) { return value; }; };
    std::vector<HeightSource> sources;
    sources.push_back({"upper", {raster_of(plane(60, 2), constant(5))}, 2, 10});
    sources.push_back({"base", {raster_of(plane(200, 1), constant(1))}, -1});
    sources.push_back({"middle", {raster_of(plane(80, 2), constant(3))}, 1, 10, PatchMatch::offset});
    const HeightStack stack = make_height_stack(domain, sources);
    CHECK(stack.overlaps[0].name == "middle");
    CHECK_THAT(stack.overlaps[0].shift_m, WithinAbs(-2, 1e-9));
    CHECK_THAT(height(stack.layers, {70, 0, 0}), WithinAbs(1, 1e-9)); // fitted to the base
    CHECK_THAT(height(stack.layers, {0, 0, 0}), WithinAbs(5, 1e-9));
    CHECK(to_string(stack.overlaps[0]) == "middle: minus what is below it, at 6400 points: mean 2.00 m, rms "
                                          "2.00 m, shifted by -2.00 m; blended over 10 m");
    // Without a width: 16 pixels of the patch, or 4 of those below.
    sources[0].feather_m.reset();
    CHECK_THAT(make_height_stack(domain, sources).overlaps[1].feather_m, WithinAbs(30, 1e-9)); // a quarter
    sources[0].raster.raster = raster_of(plane(600, 0.2), constant(5));
    CHECK_THAT(make_height_stack(domain, sources).overlaps[1].feather_m, WithinAbs(8, 1e-9));
}

TEST_CASE("What a patch hides all over a tile is not made") {
    class Counted final : public HeightLayer {
    public:
        void apply(const VertexGrid& /*grid*/, std::span<double> heights_m,
                   std::span<double> /*sample_spacings_m*/) const override {
            ++count;
            std::fill(heights_m.begin(), heights_m.end(), 7);
        }
        [[nodiscard]] HeightRange range(const Cap& /*cap*/, double /*spacing_m*/,
                                        HeightRange /*below*/) const override {
            return {-10, 10};
        }
        mutable int count = 0;
    };
    const SurfaceDomain domain = SurfaceDomain::plane(1000);
    std::vector<HeightSource> sources(2);
    sources[0] = {"base", {raster_of(plane(100, 20), flat)}};
    sources[1] = {"patch", {raster_of(plane(100, 5, 100, 0), [](Vec3 p) { return 0.01 * p.x; })}, 1, 50};
    const HeightStack stack = make_height_stack(domain, sources);
    const auto counted = std::make_shared<const Counted>();
    const TileMaker maker(domain, {counted, stack.layers[1]});
    TileMaker::Scratch scratch;
    const auto tile = std::make_unique<SurfaceTile>();
    // The patch is whole from x = -90 to 290 m and y = -190 to 190 m; a tile of level 4 is 125 m wide.
    CHECK(maker.make({0, 4, 8, 8}, scratch, *tile) == 0);
    CHECK(counted->count == 0);
    CHECK_THAT(tile->height_m(128, 128), WithinAbs(0.625, 1e-3));
    // Beside it both are seen.
    CHECK(maker.make({0, 4, 6, 8}, scratch, *tile) == 0);
    CHECK(counted->count == 1);
    CHECK_THAT(tile->height_m(0, 128), WithinAbs(7, 1e-3));
}

TEST_CASE("The distance to holes is that of a search over all of them") {
    std::mt19937 engine(5);
    std::vector<char> holes(120 * 120, 0);
    for (int k = 0; k < 25; ++k)
        holes[engine() % holes.size()] = 1;
    const MapFrame frame = plane(120, 3);
    const auto raster = raster_of(frame, flat, [&](std::int64_t i, std::int64_t j) {
        return holes[static_cast<std::size_t>(120 * j + i)] != 0;
    });
    const Coverage coverage(raster);
    std::uniform_real_distribution<double> any(-180, 180);
    for (int k = 0; k < 3000; ++k) {
        const Vec3 p{any(engine), any(engine), 0};
        const SamplePlace at = frame.place(p);
        double nearest = std::min({at.x, 119 - at.x, at.y, 119 - at.y}) + 0.5;
        for (int j = 0; j < 120; ++j)
            for (int i = 0; i < 120; ++i)
                if (holes[static_cast<std::size_t>(120 * j + i)] != 0)
                    nearest = std::min(nearest, std::hypot(at.x - i, at.y - j));
        // It ends two samples before the edge, and is the distance of cells, linear between their middles.
        const double wanted = 3 * std::max(nearest - 2, 0.0), found = coverage.distance(p);
        REQUIRE(found <= wanted + 1e-6);
        REQUIRE(found >= wanted - 3 * 1.5);
        const double radius = 10;
        const double turn = any(engine) / 180 * pi;
        const Vec3 near{p.x + radius * std::cos(turn), p.y + radius * std::sin(turn), 0};
        REQUIRE(coverage.min_distance(p, radius) <= coverage.distance(near) + 1e-9);
    }
}

TEST_CASE("A patch with a hole shows what is below it, without a jump") {
    const SurfaceDomain domain = SurfaceDomain::plane(100);
    std::vector<HeightSource> sources(2);
    sources[0] = {"base", {raster_of(plane(100, 2), flat)}};
    sources[1] = {"patch",
                  {raster_of(
                      plane(200, 1), [](Vec3) { return 10; },
                      [](std::int64_t i, std::int64_t j) { return i > 80 && i < 90 && j > 80 && j < 120; })},
                  1,
                  16};
    const HeightStack stack = make_height_stack(domain, sources);
    CHECK(height(stack.layers, {-15, 0, 0}) == 0);
    CHECK_THAT(height(stack.layers, {40, 0, 0}), WithinAbs(10, 1e-9));
    for (const double spacing : {0.0, 3.0, 9.0})
        for (double x = -60, before = height(stack.layers, {x, 0, 0}, spacing); x < 60; x += 0.01) {
            const double now = height(stack.layers, {x, 0, 0}, spacing);
            REQUIRE_THAT(now - before, WithinAbs(0, 0.011));
            before = now;
        }
}

TEST_CASE("A base without heights somewhere is refused, naming the place") {
    const SurfaceDomain plane_domain = SurfaceDomain::plane(100);
    const auto stack = [](const SurfaceDomain& domain, const MapFrame& frame, bool hole) {
        std::vector<HeightSource> sources(1);
        sources[0] = {"map.tif", {raster_of(frame, flat, [=](std::int64_t i, std::int64_t j) {
                          return hole && i == 7 && j == 3;
                      })}};
        return make_height_stack(domain, sources);
    };
    CHECK_THROWS_WITH(stack(plane_domain, plane(40, 5), true),
                      ContainsSubstring("map.tif: has pixels without data"));
    CHECK_THROWS_WITH(stack(plane_domain, plane(39, 5), false),
                      ContainsSubstring("corner x -100 m, y -100 m"));
    CHECK_NOTHROW(stack(plane_domain, plane(40, 5), false));
    const SurfaceDomain sphere = SurfaceDomain::ellipsoid({1000, 1000, 1000});
    const MapFrame band =
        MapFrame::by_edges(Projection::of_sphere(ProjectionKind::simple_cylindrical, 1000),
                           Registration::pixel, 72, 30, 0, 360 * degree, 75 * degree, -75 * degree);
    CHECK_THROWS_WITH(stack(sphere, band, false),
                      ContainsSubstring("does not reach longitude -180, latitude 90"));
    CHECK_NOTHROW(stack(sphere, global(36, 1000), false));
}

TEST_CASE("Heights along the normal and radii are the same surface as heights along the radius") {
    // Mars: the surface is given by geodetic latitude and height above the spheroid.
    const double a = 3396190, b = 3376200;
    const SurfaceDomain domain = SurfaceDomain::ellipsoid({a, a, b});
    const auto relief = [](double longitude, double latitude) {
        return 8000 * std::sin(3 * longitude) * std::cos(latitude) + 6000 * std::sin(4 * latitude);
    };
    Projection projection = Projection::of_sphere(ProjectionKind::simple_cylindrical, a);
    projection.polar_radius_m = b;
    projection.latitudes = Latitudes::planetographic;
    const MapFrame frame = MapFrame::by_edges(projection, Registration::pixel, 1440, 720, 0, 360 * degree,
                                              90 * degree, -90 * degree);
    const auto raster = raster_of(frame, [&](Vec3 p) {
        return relief(frame.projection().longitude_rad(p), frame.projection().latitude_rad(p));
    });
    const RasterLayer layer(domain, {raster, HeightMeaning::normal});
    Raster::Reader reader(*raster);
    std::vector<Vec3> bases;
    double worst = 0;
    for (double longitude = 0.1; longitude < 6; longitude += 0.37)
        for (double latitude = -1.4; latitude < 1.45; latitude += 0.09) {
            const Vec3 normal{std::cos(latitude) * std::cos(longitude),
                              std::cos(latitude) * std::sin(longitude), std::sin(latitude)};
            const double n =
                a * a / std::sqrt(a * a * (1 - normal.z * normal.z) + b * b * normal.z * normal.z);
            const Vec3 foot{n * normal.x, n * normal.y, n * normal.z * b * b / (a * a)};
            const Vec3 top = foot + relief(longitude, latitude) * normal;
            const Vec3 up = normalized(top);
            const Vec3 base = up / std::sqrt((up.x * up.x + up.y * up.y) / (a * a) + up.z * up.z / (b * b));
            REQUIRE_THAT(layer.height_m(reader, base, 0), WithinAbs(length(top) - length(base), 0.1));
            worst = std::max(worst, std::abs(relief(longitude, latitude) - (length(top) - length(base))));
            bases.push_back(base);
            const HeightRange range = layer.range({base, 30000}, 0, {});
            REQUIRE(range.least <= length(top) - length(base));
            REQUIRE(range.largest >= length(top) - length(base));
        }
    CHECK(worst < 1); // of the length itself the difference is second order: the place is what moves
    // Distances from the centre, by planetocentric latitude, on a triaxial body.
    const SurfaceDomain triaxial = SurfaceDomain::ellipsoid({1300, 1100, 900});
    const MapFrame centric = global(180, 1000);
    const RasterLayer radii(triaxial, {raster_of(centric, [](Vec3 p) { return 0.001 * (1000 + 100 * p.x); }),
                                       HeightMeaning::radius, 1000, 7});
    Raster::Reader radius_reader(radii.raster());
    const Vec3 along = normalized(Vec3{0.3, -0.5, 0.4});
    const Vec3 base = along / std::sqrt(along.x * along.x / 1.69e6 + along.y * along.y / 1.21e6 +
                                        along.z * along.z / 8.1e5);
    CHECK_THAT(radii.height_m(radius_reader, base, 0), WithinAbs(1007 + 100 * along.x - length(base), 1e-2));
}

TEST_CASE("No height of a stack lies outside of the bounds of its caps") {
    std::mt19937 engine(11);
    std::uniform_real_distribution<double> uniform(0, 1);
    const double r = 1000;
    const SurfaceDomain domain = SurfaceDomain::ellipsoid({r, 0.95 * r, 0.9 * r});
    const auto rough = [&](double amplitude) {
        return [&engine, amplitude, noise = std::uniform_real_distribution<double>(-1, 1)](Vec3 p) mutable {
            return amplitude * (p.z + noise(engine));
        };
    };
    std::vector<HeightSource> sources(3);
    sources[0] = {"base", {raster_of(global(90, r), rough(20))}};
    const MapFrame strip =
        MapFrame::by_edges(Projection::of_sphere(ProjectionKind::simple_cylindrical, r), Registration::pixel,
                           100, 220, 20 * degree, 60 * degree, 0, -88 * degree);
    sources[1] = {
        "strip",
        {raster_of(strip, rough(40), [](std::int64_t i, std::int64_t j) { return i == 30 && j == 100; })},
        1,
        30};
    Projection polar = Projection::of_sphere(ProjectionKind::south_polar_stereographic, r);
    sources[2] = {
        "pole",
        {raster_of(MapFrame(polar, {-200, 2, 0, 200, 0, -2}, Registration::pixel, 200, 200), rough(60)),
         HeightMeaning::normal},
        2,
        40};
    const HeightStack stack = make_height_stack(domain, sources);
    int narrow = 0; // bounds of the base alone: 1.6 of its range of 80 m; of the patches more
    for (int k = 0; k < 400; ++k) {
        Vec3 d;
        do
            d = {2 * uniform(engine) - 1, 2 * uniform(engine) - 1, 2 * uniform(engine) - 1};
        while (length(d) > 1 || length(d) < 0.1);
        d = normalized(k % 2 == 0 ? Vec3{0.3 * d.x + 0.2, 0.3 * d.y + 0.1, -std::abs(d.z)} : d);
        const auto surface = [&](Vec3 v) {
            return v /
                   std::sqrt(v.x * v.x / (r * r) + v.y * v.y / (0.9025 * r * r) + v.z * v.z / (0.81 * r * r));
        };
        const Vec3 centre = surface(d);
        const double radius = r * std::exp2(-1 - 8 * uniform(engine)),
                     spacing = 40 * uniform(engine) * uniform(engine);
        HeightRange range;
        for (const auto& layer : stack.layers)
            range = layer->range({centre, radius}, spacing, range);
        if (range.largest - range.least < 150) ++narrow;
        std::vector<Vec3> points;
        Vec3 u, v;
        orthonormal_basis(d, u, v);
        while (points.size() < 100) {
            const Vec3 p = surface(normalized(centre + radius * (2 * uniform(engine) - 1) * u +
                                              radius * (2 * uniform(engine) - 1) * v));
            if (length(p - centre) <= radius) points.push_back(p);
        }
        for (const double s : {0.0, spacing / 3, spacing})
            for (const double h : heights_at(stack.layers, points, s)) {
                REQUIRE(h >= range.least);
                REQUIRE(h <= range.largest);
            }
    }
    CHECK(narrow > 10);
}

} // namespace height_stack_test
