// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/exact_math.hpp"
#include "terrain/detail/octaves.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/unit/terrain/made_tiles.hpp"

#include <hwy/targets.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <thread>

namespace octaves_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double moon_radius_m = 1737400;
const SurfaceDomain moon = SurfaceDomain::ellipsoid({moon_radius_m, moon_radius_m, moon_radius_m});
using Layers = std::vector<const HeightLayer*>;

/// Rms over tiles of (difference of heights at a distance) / (the table's), by lag in vertices: 1 << n.
struct Deviations {
    std::array<double, 8> squares{}, counts{};

    void add(const MadeTile& tile, const SlopeTable& table) {
        for (std::size_t n = 0; n < squares.size(); ++n) {
            const int lag = 1 << n;
            for (int j = 0; j <= tile_cells; j += 16)
                for (int i = 0; i + lag <= tile_cells; i += 16) {
                    add(n, tile.at(i + lag, j) - tile.at(i, j),
                        table.deviation_m(length(tile.position(i + lag, j) - tile.position(i, j))));
                    add(n, tile.at(j, i + lag) - tile.at(j, i),
                        table.deviation_m(length(tile.position(j, i + lag) - tile.position(j, i))));
                }
        }
    }
    void add(std::size_t n, double difference, double wanted) {
        squares[n] += difference * difference / (wanted * wanted);
        ++counts[n];
    }
    [[nodiscard]] double ratio(std::size_t n) const { return std::sqrt(squares[n] / counts[n]); }
};

/// LDEM_4 as a layer: Catmull-Rom cubics of its pixels.
class Ldem4 final : public HeightLayer {
public:
    static constexpr double spacing_m = 7580.8376;

    explicit Ldem4(const std::filesystem::path& file) : samples_(std::size_t{columns} * rows) {
        std::ifstream in(file, std::ios::binary);
        in.read(reinterpret_cast<char*>(samples_.data()),
                static_cast<std::streamsize>(samples_.size() * sizeof(std::int16_t)));
    }
    void apply(const VertexGrid& grid, std::span<double> heights_m,
               std::span<double> sample_spacings_m) const override {
        for (std::size_t n = 0; n < heights_m.size(); ++n) {
            const Vec3 p = grid.positions_m[n];
            const double x = std::atan2(p.y, p.x) / M_PI * rows + columns - 0.5;
            const double y = std::acos(p.z / length(p)) / M_PI * rows - 0.5;
            const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
            const auto u = weights(x - i), v = weights(y - j);
            for (int b = 0; b < 4; ++b)
                for (int a = 0; a < 4; ++a)
                    heights_m[n] += u[static_cast<std::size_t>(a)] * v[static_cast<std::size_t>(b)] *
                                    pixel(i - 1 + a, j - 1 + b);
            sample_spacings_m[n] = spacing_m;
        }
    }
    [[nodiscard]] HeightRange range(const Cap& /*cap*/, double /*spacing_m*/,
                                    HeightRange /*below*/) const override {
        return {-9500, 11000, spacing_m};
    }

private:
    static constexpr int columns = 1440, rows = 720;
    static std::array<double, 4> weights(double t) {
        return {((-0.5 * t + 1) * t - 0.5) * t, (1.5 * t - 2.5) * t * t + 1, ((-1.5 * t + 2) * t + 0.5) * t,
                (0.5 * t - 0.5) * t * t};
    }
    [[nodiscard]] double pixel(int i, int j) const {
        if (j < 0 || j >= rows) {
            j = j < 0 ? -1 - j : 2 * rows - 1 - j;
            i += rows;
        }
        return 0.5 * samples_[static_cast<std::size_t>(j * columns + (i + columns) % columns)];
    }
    std::vector<std::int16_t> samples_;
};

} // namespace

TEST_CASE("Exact functions agree with the C library in long double", "[terrain]") {
    for (double x = 1e-12; x < 1e12; x *= 1.37) {
        CHECK(std::abs(exact_log2(x) - static_cast<double>(std::log2(static_cast<long double>(x)))) <=
              4e-16 * (1 + std::abs(std::log2(x))));
        const double y = std::log2(x);
        CHECK_THAT(exact_exp2(y),
                   WithinRel(static_cast<double>(std::exp2(static_cast<long double>(y))), 2e-15));
    }
    for (double x = -1.5; x < 1.5; x += 0.01)
        CHECK_THAT(exact_tan(x),
                   WithinAbs(static_cast<double>(std::tan(static_cast<long double>(x))), 1e-12));
}

TEST_CASE("Gradient noise has the stated structure function", "[terrain]") {
    // 40 lattices, points along straight lines.
    for (const double distance : {0.1, 0.5, 1.0, 3.0}) {
        double squares = 0, differences = 0, largest = 0;
        std::size_t count = 0;
        for (int octave = 0; octave < 40; ++octave) {
            const NoiseLattice lattice = noise_lattice(11, octave, 5);
            std::vector<Vec3> here, there;
            for (int n = 0; n < 20000; ++n) {
                here.push_back({n * 3.1, n * -1.7, n * 0.37});
                there.push_back(here.back() + 5 * distance * Vec3{0.6, 0, 0.8});
            }
            std::vector<float> a(here.size()), b(here.size());
            gradient_noise(lattice, here, a);
            gradient_noise(lattice, there, b);
            for (std::size_t n = 0; n < a.size(); ++n) {
                const double first = a[n], second = b[n];
                squares += first * first;
                differences += (first - second) * (first - second);
                largest = std::max(largest, std::abs(first));
            }
            count += a.size();
        }
        INFO(distance);
        CHECK_THAT(squares / static_cast<double>(count), WithinAbs(1, 0.02));
        CHECK_THAT(differences / static_cast<double>(count), WithinRel(noise_structure(distance), 0.03));
        CHECK(largest <= static_cast<double>(noise_bound));
        CHECK(largest > 3);
    }
}

TEST_CASE("Noise is the same with all sets of vector instructions", "[terrain]") {
    std::vector<Vec3> points;
    for (int n = 0; n < 1001; ++n)
        points.push_back({n * 17.3 - 9000, n * 0.31, -n * 1.7e3});
    std::vector<float> first(points.size()), again(points.size());
    gradient_noise(noise_lattice(5, 3, 8), points, first);
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(target);
        INFO(hwy::TargetName(target));
        gradient_noise(noise_lattice(5, 3, 8), points, again);
        CHECK(again == first);
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

TEST_CASE("Made surfaces have the slopes of the table at dyadic baselines", "[terrain]") {
    for (const TerrainClass terrain : {TerrainClass::highlands, TerrainClass::maria, TerrainClass::mars}) {
        const SlopeTable table = SlopeTable::of_class(terrain);
        const Octaves octaves(moon, table, 3, false);
        for (const int level : {5, 9, 14}) {
            Deviations made;
            for (std::uint64_t n = 0; n < 150; ++n)
                made.add(make_tile(moon, tile_of_number(moon, level, n), Layers{&octaves}), table);
            for (std::size_t n = 1; n < 8; ++n) { // 2 to 128 vertices
                INFO(static_cast<int>(terrain) << " level " << level << " lag " << (1 << n));
                CHECK_THAT(made.ratio(n), WithinAbs(1, 0.1));
            }
        }
    }
}

TEST_CASE("A Hurst exponent gives slopes after that power", "[terrain]") {
    const SurfaceDomain plane = SurfaceDomain::plane(8192);
    const SlopeTable table = SlopeTable::of_hurst({10, 8 * M_PI / 180}, 0.8, 2000);
    CHECK_THAT(table.deviation_m(160) / table.deviation_m(10), WithinRel(std::pow(16, 0.8), 1e-12));
    const Octaves octaves(plane, table, 3, false);
    for (const int level : {2, 6}) {
        Deviations made;
        for (std::uint64_t n = 0; n < 100; ++n)
            made.add(make_tile(plane, tile_of_number(plane, level, n), Layers{&octaves}), table);
        for (std::size_t n = 1; n < (level == 2 ? 6u : 8u); ++n) {
            INFO("level " << level << " lag " << (1 << n));
            CHECK_THAT(made.ratio(n), WithinAbs(1, 0.1));
        }
    }
}

TEST_CASE("Octaves fill in what is between the samples of LDEM_4", "[terrain][data]") {
    const auto file = test::data_file("dem_moon_lola_ldem4/LDEM_4.IMG");
    if (!file) return;
    const Ldem4 map(*file);
    const SlopeTable table = SlopeTable::of_class(TerrainClass::highlands);
    const Octaves octaves(moon, table, 7, true);
    for (const int level : {3, 5, 7}) {
        Deviations bare, made;
        int used = 0;
        for (std::uint64_t n = 0; used < 60; ++n) {
            const TileKey key = tile_of_number(moon, level, n);
            const Vec3 p = moon.point(key.face, SurfaceDomain::coordinate(level, key.i, tile_cells / 2),
                                      SurfaceDomain::coordinate(level, key.j, tile_cells / 2));
            // Highlands of the far side.
            const double latitude = std::asin(p.z / moon_radius_m) * 180 / M_PI;
            const double from_far = std::atan2(-p.y, -p.x) * 180 / M_PI;
            if (latitude < -40 || latitude > 60 || from_far < -30 || from_far > 50) continue;
            ++used;
            bare.add(make_tile(moon, key, Layers{&map}), table);
            made.add(make_tile(moon, key, Layers{&map, &octaves}), table);
        }
        for (std::size_t n = 1; n < 8; ++n) {
            const double baseline_m = moon.spacing_m(level) * (1 << n);
            INFO("baseline " << baseline_m << " m, the map alone " << bare.ratio(n));
            CHECK_THAT(made.ratio(n), WithinAbs(1, 0.1));
            if (baseline_m < 2000) CHECK(bare.ratio(n) < 0.75);
        }
    }
}

TEST_CASE("Octaves are continuous between tiles and faces, and the same in any order", "[terrain]") {
    const Octaves octaves(moon, SlopeTable::of_class(TerrainClass::maria), 1, false);
    const Layers layers{&octaves};
    SECTION("neighbours of a level share their edge") {
        const MadeTile a = make_tile(moon, {0, 9, 100, 317}, layers),
                       b = make_tile(moon, {0, 9, 101, 317}, layers);
        for (int j = -1; j <= tile_cells + 1; ++j)
            for (int i = -1; i <= 1; ++i)
                REQUIRE(a.at(tile_cells + i, j) == b.at(i, j));
    }
    SECTION("faces share their edge") {
        // u = 1 of face 0 (+x; u along y, v along z) is v = 1 of face 2 (+y; u along z, v along x).
        const MadeTile a = make_tile(moon, {0, 6, 63, 20}, layers),
                       b = make_tile(moon, {2, 6, 20, 63}, layers);
        for (int n = 0; n <= tile_cells; ++n) {
            REQUIRE(a.position(tile_cells, n) == b.position(n, tile_cells));
            REQUIRE(a.at(tile_cells, n) == b.at(n, tile_cells));
        }
    }
    SECTION("a finer level keeps vertices but for the octaves that it adds") {
        const MadeTile coarse = make_tile(moon, {3, 8, 9, 200}, layers),
                       fine = make_tile(moon, {3, 9, 18, 400}, layers);
        double added = 0;
        for (const Octave& octave : octaves.octaves()) {
            const double spacing = std::ldexp(1.0, octave.exponent);
            if (spacing >= 2 * fine.spacing_m && spacing < 2 * coarse.spacing_m)
                added += octave.rms_m * static_cast<double>(noise_bound);
        }
        double largest = 0;
        for (int j = 0; j <= tile_cells / 2; ++j)
            for (int i = 0; i <= tile_cells / 2; ++i)
                largest = std::max(largest, std::abs(coarse.at(i, j) - fine.at(2 * i, 2 * j)));
        CHECK(largest <= added);
        CHECK(largest > 0);
    }
    SECTION("threads") {
        const TileKey key{4, 11, 700, 3};
        const MadeTile first = make_tile(moon, key, layers);
        std::vector<std::thread> threads;
        std::array<MadeTile, 3> again;
        for (std::size_t n = 0; n < again.size(); ++n)
            threads.emplace_back([&, n] {
                const TileKey other{static_cast<std::uint8_t>(n), 7, 3, 4};
                (void)make_tile(moon, other, layers);
                again[n] = make_tile(moon, key, layers);
            });
        for (std::thread& thread : threads)
            thread.join();
        for (const MadeTile& tile : again)
            CHECK(tile.heights_m == first.heights_m);
    }
    SECTION("another seed") {
        const Octaves others(moon, SlopeTable::of_class(TerrainClass::maria), 2, false);
        CHECK(make_tile(moon, {0, 5, 3, 4}, layers).heights_m !=
              make_tile(moon, {0, 5, 3, 4}, Layers{&others}).heights_m);
    }
}

TEST_CASE("Octaves blend where patches of different resolution meet", "[terrain]") {
    // Samples of 64 m left of x = 0, of 1 m right of 100 m, between them a feather.
    struct Spacings final : HeightLayer {
        void apply(const VertexGrid& grid, std::span<double> /*heights_m*/,
                   std::span<double> sample_spacings_m) const override {
            for (std::size_t n = 0; n < sample_spacings_m.size(); ++n) {
                const double w = smooth_step(grid.positions_m[n].x / 100);
                sample_spacings_m[n] = 1 / ((1 - w) / 64 + w / 1);
            }
        }
        [[nodiscard]] HeightRange range(const Cap& /*cap*/, double /*spacing_m*/,
                                        HeightRange /*below*/) const override {
            return {0, 0, 64};
        }
    };
    const SurfaceDomain plane = SurfaceDomain::plane(1024);
    const Spacings spacings;
    const Octaves octaves(plane, SlopeTable::of_class(TerrainClass::maria), 1, true);
    const Layers layers{&spacings, &octaves};
    const MadeTile left = make_tile(plane, {0, 2, 1, 1}, layers),
                   right = make_tile(plane, {0, 2, 2, 1}, layers),
                   coarse = make_tile(plane, {0, 1, 0, 0}, layers);
    for (int j = 0; j <= tile_cells; ++j)
        REQUIRE(left.at(tile_cells, j) == right.at(0, j));
    double rough = 0, smooth = 0, step = 0;
    for (int j = 0; j <= tile_cells; ++j)
        for (int i = 0; i < tile_cells; ++i) {
            rough = std::max(rough, std::abs(left.at(i, j)));
            if (right.position(i, j).x > 100) smooth = std::max(smooth, std::abs(right.at(i, j)));
            step = std::max(step, std::abs(right.at(i + 1, j) - right.at(i, j)));
        }
    CHECK(rough > 2);
    CHECK(smooth < 0.3);
    CHECK(step < 1.5); // of 2 m cells: no edge
    CHECK(coarse.heights_m.size() == tile_vertices);
}

TEST_CASE("Bounds of octaves hold for all finer vertices", "[terrain]") {
    const SurfaceDomain triaxial = SurfaceDomain::ellipsoid({1200, 900, 700});
    for (const bool over_maps : {false, true}) {
        double excess = 0;
        int ranges = 0;
        const Octaves on_moon(moon, SlopeTable::of_class(TerrainClass::highlands), 1, over_maps);
        const Octaves on_rubble(triaxial, SlopeTable::of_class(TerrainClass::rubble_pile), 1, over_maps);
        for (std::uint64_t n = 0; n < 12; ++n)
            for (const int level : {0, 2, 6, 12, 18}) {
                excess += check_bounds(moon, on_moon, level, n);
                excess += check_bounds(triaxial, on_rubble, level / 2, n);
                ranges += 2;
            }
        if (!over_maps) CHECK(excess / ranges < 8); // of use
    }
}

} // namespace octaves_test
