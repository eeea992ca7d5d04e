// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/craters.hpp"
#include "terrain/detail/octaves.hpp"
#include "terrain/detail/stamp_kernel.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/terrain/made_tiles.hpp"

#include <hwy/targets.h>

#include <cmath>
#include <cstring>

namespace craters_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double moon_radius_m = 1737400;
const SurfaceDomain moon = SurfaceDomain::ellipsoid({moon_radius_m, moon_radius_m, moon_radius_m});
using Layers = std::vector<const HeightLayer*>;

/// Counts craters above diameters by hand, against N(>D) times an area.
void check_counts(const Craters& craters, const Cap& cap, double area_m2,
                  std::initializer_list<double> diameters_m) {
    const std::vector<Crater> found = craters.near(cap, *diameters_m.begin(), 0);
    for (const double diameter_m : diameters_m) {
        double count = 0;
        for (const Crater& crater : found)
            if (crater.diameter_m > diameter_m && length(crater.position_m - cap.centre_m) <= cap.radius_m)
                ++count;
        const double mean = area_m2 * craters.law().per_m2(diameter_m);
        INFO("D > " << diameter_m << " m: " << count << " for " << mean);
        CHECK(std::abs(count - mean) <= 3 * std::sqrt(mean));
    }
}

} // namespace

TEST_CASE("Crater counts of the law are those of its sources", "[terrain]") {
    // Neukum, Ivanov, Hartmann (2001): N(1 km) of 1 Ga is 8.38e-4 per km2; their production function has
    // 10^-3.0876 there, and 10^-3.0876 * 10^(sum of the a_k) at 10 km.
    const CraterLaw billion(1);
    CHECK_THAT(CraterLaw::chronology(1), WithinRel(8.38e-4, 1e-6));
    CHECK_THAT(billion.production_per_m2(1000) * 1e6, WithinRel(std::pow(10, -3.0876), 1e-9));
    CHECK_THAT(billion.production_per_m2(10e3) * 1e6, WithinRel(std::pow(10, -5.3476256), 1e-3));
    // 3.9 Ga: 5.44e-14 (e^27.027 - 1) + 8.38e-4 * 3.9.
    CHECK_THAT(CraterLaw::chronology(3.9), WithinRel(5.44e-14 * std::expm1(27.027) + 8.38e-4 * 3.9, 1e-9));
    CHECK_THAT(billion.age_of(CraterLaw::chronology(0.4)), WithinAbs(0.4, 1e-3));
    CHECK_THAT(billion.age_of(CraterLaw::chronology(4.1)), WithinAbs(4.1, 1e-3));
    // Trask (1966): 10^-1.1 D^-2: 7.94 craters above 100 m per km2.
    CHECK_THAT(CraterLaw(3.9).per_m2(100) * 1e6, WithinRel(7.943, 1e-3));
    CHECK(CraterLaw(3.9).per_m2(20e3) == CraterLaw(3.9).production_per_m2(20e3));
    // The oldest in equilibrium made as many as are left.
    const double age = CraterLaw(3.9).age_of(CraterLaw(3.9).oldest(100));
    CHECK_THAT(CraterLaw(age).production_per_m2(100) * 1e6, WithinRel(7.943, 1e-2));
}

TEST_CASE("Made craters follow the law", "[terrain]") {
    SECTION("whole Moon") {
        const Craters craters(moon, {.age_ga = 3.9, .min_diameter_m = 1000}, 1);
        check_counts(craters, {{0, 0, 0}, 2 * moon_radius_m}, 4 * M_PI * moon_radius_m * moon_radius_m,
                     {16e3, 20e3, 32e3, 64e3, 100e3});
    }
    SECTION("caps, also across an edge and a corner of the cube") {
        const Craters craters(moon, {.age_ga = 3.5}, 2);
        const auto cap = [&](Vec3 towards, double radius) {
            return Cap{normalized(towards) * moon_radius_m, radius};
        };
        const auto area = [](double chord) { return M_PI * chord * chord; };
        check_counts(craters, cap({1, 0.1, 0.2}, 300), area(300), {0.7, 1, 2, 5, 10});
        check_counts(craters, cap({1, 1, 0.2}, 10e3), area(10e3), {40, 64, 100, 200});
        check_counts(craters, cap({1, 1, 1}, 100e3), area(100e3), {300, 500, 1000, 2000});
    }
    SECTION("triaxial") {
        const Vec3 radii{30e3, 22e3, 15e3};
        const SurfaceDomain body = SurfaceDomain::ellipsoid(radii);
        const Craters craters(body, {.age_ga = 3.9}, 3);
        // Knud Thomsen's formula, good to 1.1 %: small against 3 sigma of these counts.
        const double p = 1.6075;
        const double area = 4 * M_PI *
                            std::pow((std::pow(radii.x * radii.y, p) + std::pow(radii.y * radii.z, p) +
                                      std::pow(radii.z * radii.x, p)) /
                                         3,
                                     1 / p);
        check_counts(craters, {{0, 0, 0}, 40e3}, area, {300, 500, 1000, 2000});
    }
    SECTION("plane") {
        const SurfaceDomain plane = SurfaceDomain::plane(2000);
        const Craters craters(plane, {.age_ga = 3.9}, 4);
        check_counts(craters, {{100, 50, 0}, 1500}, M_PI * 1500 * 1500, {8, 16, 50, 100});
    }
}

TEST_CASE("Crater profiles wear by diffusion", "[terrain]") {
    // Against the same equation on a square grid in the plane.
    const double diameter = 1000;
    const CraterProfiles profiles(diameter, 0.2);
    CraterProfile fresh{}, worn{};
    profiles.at(0, fresh.data());
    profiles.at(0.2, worn.data());
    const auto at = [](const CraterProfile& profile, double r) {
        const double place = r * r * CraterProfiles::steps / CraterProfiles::reach_squared;
        if (place >= CraterProfiles::steps) return 0.0;
        const auto n = static_cast<std::size_t>(place);
        return profile[n] + (place - static_cast<double>(n)) * (profile[n + 1] - profile[n]);
    };
    CHECK_THAT(at(fresh, 1), WithinRel(crater_rim_m(diameter) / diameter, 0.01));
    CHECK_THAT(at(fresh, 1) - at(fresh, 0), WithinRel(crater_depth_m(diameter) / diameter, 0.01));
    CHECK_THAT(crater_depth_m(1000), WithinAbs(196, 1)); // Pike
    CHECK_THAT(crater_depth_m(100e3), WithinRel(1044 * std::pow(100, 0.301), 1e-9));

    constexpr int half = 80, edge = 2 * half + 1;
    constexpr double step = 0.04, time_step = 0.2 * step * step;
    std::vector<double> heights(edge * edge), next;
    for (int j = 0; j < edge; ++j)
        for (int i = 0; i < edge; ++i)
            heights[static_cast<std::size_t>(j * edge + i)] =
                at(fresh, std::hypot(i - half, j - half) * step);
    const int times = static_cast<int>(std::lround(0.2 / time_step));
    for (int n = 0; n < times; ++n) {
        next = heights;
        for (int j = 1; j + 1 < edge; ++j)
            for (int i = 1; i + 1 < edge; ++i) {
                const auto k = static_cast<std::size_t>(j * edge + i);
                next[k] += 0.2 * (heights[k - 1] + heights[k + 1] + heights[k - edge] + heights[k + edge] -
                                  4 * heights[k]);
            }
        heights.swap(next);
    }
    for (int i = 0; i < 40; ++i) {
        INFO(i * step);
        CHECK_THAT(at(worn, i * step),
                   WithinAbs(heights[static_cast<std::size_t>(half * edge + half + i)], 2e-3));
    }
    CHECK(at(worn, 0) > 0.5 * at(fresh, 0));
}

TEST_CASE("A fresh crater on a plain has the depth and the rim of its size", "[terrain]") {
    const SurfaceDomain plane = SurfaceDomain::plane(1600e3);
    // Young and large: none overlap.
    const Craters craters(plane, {.age_ga = 0.01, .min_diameter_m = 1000, .largest_diameter_m = 3000}, 5);
    const std::vector<Crater> found = craters.near({{0, 0, 0}, 1500e3}, 1200);
    int measured = 0;
    for (const Crater& crater : found) {
        if (!craters.near({crater.position_m, 2 * crater.diameter_m}, 1000, 2.5).empty() &&
            craters.near({crater.position_m, 2 * crater.diameter_m}, 1000, 2.5).size() > 1)
            continue;
        const int level = 9;
        const double tile_m = 3200e3 / 512;
        const auto number = [&](double x) { return static_cast<std::uint32_t>((x + 1600e3) / tile_m); };
        const MadeTile tile = make_tile(
            plane, {0, level, number(crater.position_m.x), number(crater.position_m.y)}, Layers{&craters});
        double deepest = 0, highest = 0;
        bool whole = true;
        for (int j = 0; j <= tile_cells; ++j)
            for (int i = 0; i <= tile_cells; ++i) {
                const double r = length(tile.position(i, j) - crater.position_m);
                if (r > 1.3 * crater.diameter_m / 2) continue;
                whole = whole && i > 0 && j > 0 && i < tile_cells && j < tile_cells;
                deepest = std::min(deepest, tile.at(i, j));
                highest = std::max(highest, tile.at(i, j));
            }
        if (!whole) continue;
        ++measured;
        INFO("D = " << crater.diameter_m);
        CHECK_THAT(highest,
                   WithinRel(crater_rim_m(crater.diameter_m), 0.2)); // worn for up to 10 Ma, between vertices
        CHECK_THAT(highest - deepest, WithinRel(crater_depth_m(crater.diameter_m), 0.05));
    }
    CHECK(measured >= 1);
}

TEST_CASE("Craters are continuous between tiles and faces, and the same in any order", "[terrain]") {
    const Craters craters(moon, {.age_ga = 4}, 1);
    const Layers layers{&craters};
    for (const int level : {1, 6, 11, 17}) {
        const auto last = static_cast<std::uint32_t>((1u << level) - 1);
        const std::uint32_t middle = last / 3;
        const auto u8 = static_cast<std::uint8_t>(level);
        const MadeTile a = make_tile(moon, {0, u8, middle, middle}, layers),
                       b = make_tile(moon, {0, u8, middle + 1, middle}, layers);
        const MadeTile edge = make_tile(moon, {0, u8, last, middle}, layers),
                       over = make_tile(moon, {2, u8, middle, last}, layers);
        double largest = 0;
        for (int n = 0; n <= tile_cells; ++n) {
            REQUIRE(a.at(tile_cells, n) == b.at(0, n));
            REQUIRE(edge.position(tile_cells, n) == over.position(n, tile_cells));
            REQUIRE(edge.at(tile_cells, n) == over.at(n, tile_cells));
            largest = std::max(largest, std::abs(a.at(tile_cells, n)));
        }
        CHECK(largest > 0);
        CHECK(make_tile(moon, {0, u8, middle, middle}, layers).heights_m == a.heights_m);
    }
}

TEST_CASE("Craters are left out where samples have them", "[terrain]") {
    struct Spacings final : HeightLayer {
        void apply(const VertexGrid& grid, std::span<double> /*heights_m*/,
                   std::span<double> sample_spacings_m) const override {
            for (std::size_t n = 0; n < sample_spacings_m.size(); ++n)
                sample_spacings_m[n] = grid.positions_m[n].x < 0 ? 100 : 2;
        }
        [[nodiscard]] HeightRange range(const Cap& /*cap*/, double /*spacing_m*/,
                                        HeightRange /*below*/) const override {
            return {0, 0, 100};
        }
    };
    const SurfaceDomain plane = SurfaceDomain::plane(2048);
    const Spacings spacings;
    const Craters craters(plane, {.age_ga = 4}, 1, true);
    const MadeTile left = make_tile(plane, {0, 1, 0, 0}, Layers{&spacings, &craters}),
                   right = make_tile(plane, {0, 1, 1, 0}, Layers{&spacings, &craters}),
                   across = make_tile(plane, {0, 0, 0, 0}, Layers{&spacings, &craters});
    const auto deepest = [](const MadeTile& tile) {
        double least = 0;
        for (int j = 0; j <= tile_cells; ++j)
            for (int i = 0; i <= tile_cells; ++i)
                least = std::min(least, tile.at(i, j));
        return least;
    };
    CHECK(deepest(left) < -10);
    CHECK(deepest(right) > -3);
    CHECK(deepest(across) < -10);
    CHECK(Craters::share(100, 100) == 1);
    CHECK(Craters::share(700, 100) == 0);
}

TEST_CASE("Bounds of craters hold for all finer vertices", "[terrain]") {
    const Craters craters(moon, {.age_ga = 4}, 1);
    double excess = 0;
    int ranges = 0;
    for (std::uint64_t n = 0; n < 16; ++n)
        for (const int level : {0, 3, 8, 13, 18}) {
            excess += check_bounds(moon, craters, level, n);
            ++ranges;
        }
    CHECK(excess / ranges < 16); // of use
}

TEST_CASE("Noise is less where craters make the slopes", "[terrain]") {
    const SlopeTable table = SlopeTable::of_class(TerrainClass::highlands);
    const Craters craters(moon, {.age_ga = 3.9}, 7);
    const Octaves octaves(moon, table, 7, false,
                          [&](double baseline_m) { return craters.deviation_m2(baseline_m); });
    for (const int level : {5, 9, 13}) {
        double squares = 0, count = 0;
        for (std::uint64_t n = 0; n < 100; ++n) {
            const MadeTile tile = make_tile(moon, tile_of_number(moon, level, n), Layers{&octaves, &craters});
            for (int j = 0; j <= tile_cells; j += 8)
                for (int i = 0; i + 4 <= tile_cells; i += 8) {
                    const double wanted =
                        table.deviation_m(length(tile.position(i + 4, j) - tile.position(i, j)));
                    const double difference = tile.at(i + 4, j) - tile.at(i, j);
                    squares += difference * difference / (wanted * wanted);
                    ++count;
                }
        }
        INFO(level);
        CHECK_THAT(std::sqrt(squares / count), WithinAbs(1, 0.1));
    }
}

TEST_CASE("Stamps are the same with all sets of vector instructions", "[terrain]") {
    BlockPoints points{};
    for (std::size_t n = 0; n < stamp_block_size; ++n) {
        points.x[n] = 0.37 * static_cast<double>(n % 8) - 1.1;
        const std::size_t row = n / 8;
        points.y[n] = 0.21 * static_cast<double>(row);
        points.z[n] = 1e-3 * static_cast<double>(n);
    }
    CraterProfile profile{};
    CraterProfiles(500, 0.5).at(0.1, profile.data());
    const ProfileStamp stamp{{0.1, 0.2, 0}, profile.data(), CraterProfiles::steps, 32, 3.7, 30, 55, 0.8};
    struct alignas(64) Values {
        BlockValues at;
    };
    const auto make = [&] {
        std::array<Values, 3> made{};
        CHECK(add_profile(points, stamp, made[0].at, made[1].at));
        made[2].at = made[0].at;
        scale_block(made[2].at, made[1].at);
        add_clamped(made[2].at, made[0].at, -0.2, 0.05);
        return made;
    };
    const auto first = make();
    for (std::size_t n = 0; n < stamp_block_size; ++n) {
        const double x = points.x[n] - 0.1, y = points.y[n] - 0.2, z = points.z[n];
        const double place = std::min((x * x + y * y + z * z) * 32, 200.0);
        const auto step = static_cast<std::size_t>(place);
        const double height =
            profile[step] + (place - static_cast<double>(step)) * (profile[step + 1] - profile[step]);
        CHECK_THAT(first[0].at[n], WithinAbs(3.7 * height, 1e-15));
        const double fade = std::clamp((55 - place) / 25, 0.0, 1.0);
        CHECK_THAT(first[1].at[n], WithinAbs(1 - 0.8 * fade * fade * (3 - 2 * fade), 1e-15));
    }
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(target);
        INFO(hwy::TargetName(target));
        const auto again = make();
        for (std::size_t k = 0; k < again.size(); ++k)
            CHECK(again[k].at == first[k].at);
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

} // namespace craters_test
