// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/craters.hpp"
#include "terrain/detail/octaves.hpp"
#include "terrain/detail/slope_loss.hpp"
#include "terrain/tiles/tile_maker.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/terrain/made_tiles.hpp"

#include <array>
#include <cmath>
#include <limits>

namespace slope_loss_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

const SurfaceDomain plane = SurfaceDomain::plane(65536);

/// Mean squared slope of the shading normals of a tile: central differences at the vertices, bilinear
/// between, integrated over each cell.
double shaded_squared_slope(const MadeTile& tile) {
    const auto along = [&](int i, int j, int axis) {
        return axis == 0 ? (tile.at(i + 1, j) - tile.at(i - 1, j)) / (2 * tile.spacing_m)
                         : (tile.at(i, j + 1) - tile.at(i, j - 1)) / (2 * tile.spacing_m);
    };
    double sum = 0;
    for (int j = 0; j < tile_cells; ++j)
        for (int i = 0; i < tile_cells; ++i)
            for (int axis = 0; axis < 2; ++axis) {
                const double a = along(i, j, axis), b = along(i + 1, j, axis), c = along(i, j + 1, axis),
                             d = along(i + 1, j + 1, axis);
                sum +=
                    (a * a + b * b + c * c + d * d + a * b + c * d + a * c + b * d + (a * d + b * c) / 2) / 9;
            }
    return sum / (tile_cells * tile_cells);
}

/// What a layer says that a spacing loses, where samples below are so far apart.
double lost_at(const HeightLayer& layer, double spacing_m,
               double sample_spacing_m = std::numeric_limits<double>::infinity()) {
    const std::array<Vec3, 1> position{};
    const std::array<double, 1> samples{sample_spacing_m};
    std::array<double, 1> lost{};
    layer.add_lost_slopes(position, spacing_m, samples, lost);
    return lost[0];
}

} // namespace

TEST_CASE("Cells keep the slopes of a sine as their differences and interpolation do", "[terrain]") {
    // Sines of all directions and one wave number k: D = 2 A^2 (1 - J0(k d)); few cells to a wave.
    const double k = 2;
    const auto structure = [&](double d) { return 2 * (1 - std::cyl_bessel_j(0, k * d)); };
    for (const double cell : {0.01, 0.2, 0.5}) {
        double kept = 0; // of the sum over directions
        constexpr int turns = 720, places = 8;
        for (int n = 0; n < turns; ++n) {
            const double turn = 2 * M_PI * n / turns, kx = k * std::cos(turn), ky = k * std::sin(turn);
            const double difference = std::sin(kx * cell) / cell;
            // Interpolation over a cell, of waves of all phases.
            for (int j = 0; j < places; ++j)
                for (int i = 0; i < places; ++i) {
                    const double s = (i + 0.5) / places, r = (j + 0.5) / places;
                    double re = 0, im = 0;
                    for (int b = 0; b < 2; ++b)
                        for (int a = 0; a < 2; ++a) {
                            const double w = (a != 0 ? s : 1 - s) * (b != 0 ? r : 1 - r);
                            const double phase = kx * cell * a + ky * cell * b;
                            re += w * std::cos(phase);
                            im += w * std::sin(phase);
                        }
                    kept += difference * difference * (re * re + im * im) / (turns * places * places);
                }
        }
        INFO(cell);
        CHECK_THAT(kept_squared_slope(structure, cell), WithinRel(kept, 0.005));
        if (cell < 0.05) CHECK_THAT(kept, WithinRel(k * k / 2, 0.001));
    }
    const SlopeLoss loss(structure, 1);
    CHECK_THAT(loss.whole(), WithinRel(k * k / 2, 0.002));
    CHECK(loss.share(2) == 1);
    CHECK(loss.share(0x1p-6) > 0);
    for (int n = 0; n < 12; ++n)
        CHECK(loss.share(std::ldexp(1.0, -n - 1)) < loss.share(std::ldexp(1.0, -n)));
}

TEST_CASE("What noise and craters lose on coarse cells is what finer ones have more", "[terrain]") {
    const Octaves noise(plane, SlopeTable::of_class(TerrainClass::highlands), 5, false);
    const Craters craters(plane, {3.8, 8, 1000}, 5);
    struct Case {
        const char* name;
        const HeightLayer& layer;
        double tolerance;
    };
    // The same ground on cells of a quarter of the width, so that longer slopes do not count.
    const auto squared_slope = [](const HeightLayer& layer, TileKey key) {
        const HeightLayer* const layers[] = {&layer};
        return shaded_squared_slope(make_tile(plane, key, layers));
    };
    for (const Case& one : {Case{"noise", noise, 0.1}, Case{"craters", craters, 0.2}})
        for (const int level : {4, 6, 8, 10}) {
            double more = 0;
            constexpr int tiles = 3, finer = 16;
            for (std::uint64_t n = 0; n < tiles; ++n) {
                const TileKey key = tile_of_number(plane, level, 11 * n + 3);
                more -= squared_slope(one.layer, key) / tiles;
                for (unsigned k = 0; k < finer; ++k)
                    more += squared_slope(one.layer, key.child(k % 4).child(k / 4)) / (tiles * finer);
            }
            const double spacing = plane.spacing_m(level);
            const double lost = lost_at(one.layer, spacing) - lost_at(one.layer, spacing / 4);
            INFO(one.name << ", cells of " << spacing << " m: " << more << " more, lost " << lost << ", all "
                          << lost_at(one.layer, 1e6));
            CHECK_THAT(lost, WithinAbs(more, one.tolerance * more + 1e-4));
        }
}

TEST_CASE("Detail between samples counts for what it fills in", "[terrain]") {
    const Octaves noise(plane, SlopeTable::of_class(TerrainClass::maria), 5, true);
    const double all = lost_at(noise, 100), none = lost_at(noise, 100, 1e-4), some = lost_at(noise, 100, 30);
    CHECK(none < 0.01 * all);
    CHECK(some < all);
    CHECK(some > none);
    // Samples that are coarser than the cells change little: what cells lose is shorter than they are.
    CHECK_THAT(lost_at(noise, 100, 1000), WithinRel(all, 0.02));
}

TEST_CASE("Tiles agree on lost slopes where they meet", "[terrain]") {
    const SurfaceDomain moon = SurfaceDomain::ellipsoid({1737400, 1737400, 1730000});
    const TileMaker maker(
        moon, {std::make_shared<Octaves>(moon, SlopeTable::of_class(TerrainClass::highlands), 5, false)});
    const auto made = [&](TileKey key) {
        TileMaker::Scratch scratch;
        const auto tile = std::make_unique<SurfaceTile>();
        REQUIRE(maker.make(key, scratch, *tile) == 0);
        return maker.lost_slopes(key, scratch);
    };
    const LostSlopes left = made({2, 5, 6, 7}), right = made({2, 5, 7, 7}), finer = made({2, 6, 12, 14});
    for (std::size_t j = 0; j < slope_edge; ++j)
        CHECK(left[j * slope_edge + slope_edge - 1] == right[j * slope_edge]);
    CHECK(left[0] > finer[0]);
    CHECK(finer[0] > 0);
}

} // namespace slope_loss_test
