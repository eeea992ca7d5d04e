// SPDX-License-Identifier: Apache-2.0
// Bounds of tiles against the vertices of all finer tiles: real maps, nested ones, detail over them.
#include "terrain/cube_sphere.hpp"
#include "terrain/detail/craters.hpp"
#include "terrain/detail/octaves.hpp"
#include "terrain/maps/cubic_bounds.hpp"
#include "terrain/maps/height_stack.hpp"
#include "terrain/maps/map_source.hpp"
#include "terrain/tiles/tile_maker.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace tile_bounds_test {

using namespace obscura;
using namespace obscura::terrain;
using namespace obscura::test;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double moon_m = 1737400;
const SurfaceDomain moon = SurfaceDomain::ellipsoid({moon_m, moon_m, moon_m});

using Layers = std::vector<std::shared_ptr<const HeightLayer>>;

HeightRaster open(const std::filesystem::path& file) {
    MapFindings found;
    MapKeys keys;
    keys.file = file;
    return open_map(keys, moon, found);
}

/// The tile of that level that holds a direction.
TileKey tile_at(Vec3 p, int level) {
    const std::size_t face = cube_face_of(p);
    const CubeFace& f = cube_faces[face];
    const double w = f.sign * component(p, f.axis), last = std::ldexp(1.0, level) - 1;
    const auto number = [&](int axis) {
        const double place = (component(p, axis) / w + 1) / 2;
        return static_cast<std::uint32_t>(std::clamp(std::floor(place * (last + 1)), 0.0, last));
    };
    return {static_cast<std::uint8_t>(face), static_cast<std::uint8_t>(level), number(f.u_axis),
            number(f.v_axis)};
}

/// Heights that are beyond the bounds of their tile or of a tile above it, in tiles of all levels up to
/// `deepest` along some places. `excess_m`: median of how far the bounds of the deepest tiles are above their
/// highest vertices.
std::size_t violations(const Layers& layers, const std::vector<Vec3>& places, int deepest, double& excess_m) {
    const TileMaker maker(moon, layers);
    TileMaker::Scratch scratch;
    const auto tile = std::make_unique<SurfaceTile>();
    std::size_t wrong = 0;
    std::vector<double> excesses_m;
    for (const Vec3 place : places) {
        std::vector<ReducedRange> above;
        for (int level = 0; level <= deepest; ++level) {
            const TileKey key = tile_at(place, level);
            above.push_back(maker.range(key));
            wrong += maker.make(key, scratch, *tile);
            const double highest = tile->maximum_m(pyramid_levels, 0, 0);
            for (const ReducedRange& range : above)
                wrong += tile->min_m < range.least || highest > range.largest ? 1 : 0;
            if (level == deepest) excesses_m.push_back(above.back().largest - highest);
        }
    }
    std::sort(excesses_m.begin(), excesses_m.end());
    excess_m = excesses_m[excesses_m.size() / 2];
    return wrong;
}

std::vector<Vec3> some_places(int count) {
    std::mt19937 engine(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    // The poles, the seam, edges and corners of faces.
    std::vector<Vec3> places{{0, 0, 1},       {1e-3, 2e-3, -1}, {-1, 1e-9, 0.2},
                             {1, -1e-4, 0.1}, {1, 1, 1},        {1, 0.3, -1}};
    while (static_cast<int>(places.size()) < count) {
        const Vec3 p{uniform(engine), uniform(engine), uniform(engine)};
        if (length(p) < 1 && length(p) > 0.1) places.push_back(normalized(p));
    }
    return places;
}

Vec3 direction(double longitude_deg, double latitude_deg) {
    return {std::cos(latitude_deg * degree) * std::cos(longitude_deg * degree),
            std::cos(latitude_deg * degree) * std::sin(longitude_deg * degree),
            std::sin(latitude_deg * degree)};
}

} // namespace

TEST_CASE("Bounds of cubics hold, and near them as the part of the cell shrinks", "[terrain]") {
    std::mt19937 engine(3);
    std::uniform_real_distribution<float> noise(-1, 1);
    std::uniform_real_distribution<double> uniform(0, 1);
    constexpr int columns = 9, rows = 8;
    for (int k = 0; k < 200; ++k) {
        std::vector<float> samples(columns * rows);
        for (float& v : samples)
            v = noise(engine);
        const double size = std::exp2(-6 * uniform(engine));
        const auto begin = [&](int count) { return 1 + (count - 3 - size * (count - 3)) * uniform(engine); };
        PlaceRectangle part{begin(columns), 0, begin(rows), 0};
        part.x1 = part.x0 + size * (columns - 3);
        part.y1 = part.y0 + size * (rows - 3);
        const CubicBounds bounds = cubic_bounds(samples, columns, part);
        const auto cubic = [](const double* v, double t) {
            return v[1] +
                   0.5 * t *
                       (v[2] - v[0] +
                        t * (2 * v[0] - 5 * v[1] + 4 * v[2] - v[3] + t * (3 * (v[1] - v[2]) + v[3] - v[0])));
        };
        double least = 1e9, largest = -1e9;
        for (int n = 0; n < 40 * 40; ++n) {
            const double x = part.x0 + (part.x1 - part.x0) * (n % 40) / 39.0,
                         y = part.y0 + (part.y1 - part.y0) * (n / 40) / 39.0;
            const int i = std::min(static_cast<int>(x), columns - 3),
                      j = std::min(static_cast<int>(y), rows - 3);
            double lines[4];
            for (int r = 0; r < 4; ++r) {
                double v[4];
                for (int c = 0; c < 4; ++c)
                    v[c] = static_cast<double>(
                        samples[static_cast<std::size_t>((j - 1 + r) * columns + i - 1 + c)]);
                lines[r] = cubic(v, x - i);
            }
            const double value = cubic(lines, y - j);
            least = std::min(least, value);
            largest = std::max(largest, value);
        }
        CAPTURE(k, size);
        REQUIRE(bounds.least <= least + 1e-12);
        REQUIRE(bounds.largest >= largest - 1e-12);
        // Second derivatives of cubics of samples within 1 are below 50; 40 places miss less than 0.1.
        const double cells = size * (columns - 3);
        if (cells < 0.5) CHECK(bounds.largest - largest < 50 * cells * cells);
    }
}

TEST_CASE("No vertex of LOLA's map is beyond the bounds of the tiles over it", "[terrain][data]") {
    const auto file = data_file("dem_moon_lola_ldem4/LDEM_4.LBL");
    if (!file) return;
    double excess_m = 0;
    const Layers layers{std::make_shared<RasterLayer>(moon, open(*file))};
    CHECK(violations(layers, some_places(24), 9, excess_m) == 0);
    // Tiles of 5 km, where pixels of 7.6 km rise by half a kilometre.
    INFO("bounds are " << excess_m << " m above the highest vertex");
    CHECK(excess_m < 300);
}

TEST_CASE("No vertex of nested maps and of detail over them is beyond the bounds of the tiles over it",
          "[terrain][data]") {
    const auto global_file = data_file("dem_moon_lola_ldem4/LDEM_4.LBL");
    const auto strip_file = data_file("dem_moon_southpole/gld100_64ppd_216-232E_42-90S.tif");
    const auto site_file = data_file("dem_moon_southpole/lola_site01_10m.tif");
    if (!global_file || !strip_file || !site_file) return;
    std::vector<HeightSource> sources(3);
    sources[0] = {"global", open(*global_file)};
    sources[1] = {"strip", open(*strip_file), 1, 4000};
    sources[2] = {"site", open(*site_file), 2, 1000};
    Layers layers = make_height_stack(moon, sources).layers;
    // The patch, its feather, the strip and its edges, and the pole, which all of them have.
    const std::vector<Vec3> places{direction(222.5, -89.4), direction(222.5, -89.15), direction(223, -88.6),
                                   direction(224, -60),     direction(216.02, -70),   direction(231.9, -50),
                                   direction(226, -42.03),  direction(100, 20),       {0, 0, -1}};
    double excess_m = 0;
    CHECK(violations(layers, places, 12, excess_m) == 0);
    layers.push_back(std::make_shared<Octaves>(moon, SlopeTable::of_class(TerrainClass::highlands), 7, true));
    layers.push_back(std::make_shared<Craters>(moon, Craters::Settings{}, 7, true));
    CHECK(violations(layers, {places.begin(), places.begin() + 4}, 12, excess_m) == 0);
}

} // namespace tile_bounds_test
