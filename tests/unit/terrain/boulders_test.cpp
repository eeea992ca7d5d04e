// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/boulders.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/terrain/made_tiles.hpp"

#include <cmath>

namespace boulders_test {

using namespace obscura;
using namespace obscura::terrain;

namespace {

const SurfaceDomain moon = SurfaceDomain::ellipsoid({1737400, 1737400, 1737400});
using Layers = std::vector<const HeightLayer*>;

double count_near(const Boulders& boulders, Vec3 centre, double radius, double diameter) {
    double count = 0;
    for (const Boulder& boulder : boulders.near({centre, radius}, diameter))
        if (length(boulder.position_m - centre) <= radius) ++count;
    return count;
}

} // namespace

TEST_CASE("Made boulders follow the law of their sizes", "[terrain]") {
    // Itokawa has 373 boulders above 5 m on 0.393 km2 (Saito et al. 2006), index 3.1.
    Boulders::Settings settings;
    settings.index = 3.1;
    settings.per_m2 = 373 / 0.393e6 * std::pow(5, 3.1);
    settings.min_diameter_m = 1;
    settings.largest_diameter_m = 40;
    const SurfaceDomain body = SurfaceDomain::ellipsoid({2500, 2500, 2500});
    const Boulders boulders(body, settings, 3, nullptr);
    const Vec3 centre = 2500 * normalized(Vec3{1, 1, 0.9}); // near a corner of the cube
    const double radius = 400, area = M_PI * radius * radius;
    for (const double diameter : {1.0, 2.0, 3.0, 5.0}) {
        // No boulder is larger than the largest.
        const double mean =
            area * settings.per_m2 * (std::pow(diameter, -3.1) - std::pow(settings.largest_diameter_m, -3.1));
        const double count = count_near(boulders, centre, radius, diameter);
        INFO("D > " << diameter << " m: " << count << " for " << mean);
        CHECK(std::abs(count - mean) <= 3 * std::sqrt(mean));
    }
}

TEST_CASE("Boulders are denser on the ejecta of young craters", "[terrain]") {
    const SurfaceDomain plane = SurfaceDomain::plane(50e3);
    const auto craters =
        std::make_shared<Craters>(plane, Craters::Settings{.age_ga = 0.2, .min_diameter_m = 100}, 1);
    Boulders::Settings settings;
    settings.per_m2 = 1e-3;
    settings.min_diameter_m = 1;
    settings.largest_diameter_m = 4;
    settings.ejecta = 20;
    const Boulders boulders(plane, settings, 3, craters);
    int seen = 0;
    for (const Crater& crater : craters->near({{0, 0, 0}, 40e3}, 300)) {
        if (crater.age_ga > 0.15) continue;
        const double radius = crater.diameter_m / 2, fresh = 1 - crater.age_ga / 0.3;
        if (craters->near({crater.position_m, 4 * radius}, 32, 4).size() > 1) continue;
        ++seen;
        double on_floor = 0, far = 0;
        for (const Boulder& boulder : boulders.near({crater.position_m, 3.5 * radius}, 1)) {
            const double r = length(boulder.position_m - crater.position_m) / radius;
            if (r < 1) ++on_floor;
            if (r > 3 && r < 3.5) ++far;
        }
        const double area = M_PI * radius * radius, law = 1e-3 * (1 - std::pow(4, -settings.index));
        const double near_mean = area * law * (1 + 20 * fresh);
        INFO("D = " << crater.diameter_m << ", " << crater.age_ga << " Ga");
        CHECK(std::abs(on_floor - near_mean) <= 3.5 * std::sqrt(near_mean));
        CHECK(far / (3.5 * 3.5 - 9) < 0.5 * on_floor);
    }
    CHECK(seen >= 3);
}

TEST_CASE("Boulders stand as domes in tiles of any order, within their bounds", "[terrain]") {
    const auto craters = std::make_shared<Craters>(moon, Craters::Settings{}, 1);
    const Boulders boulders(moon, {.per_m2 = 0.01}, 1, craters);
    const Layers layers{&boulders};
    const std::uint8_t level = 17; // 0.1 m
    const std::uint32_t last = (1u << level) - 1, middle = last / 3;
    const MadeTile a = make_tile(moon, {0, level, middle, middle}, layers),
                   b = make_tile(moon, {0, level, middle + 1, middle}, layers),
                   edge = make_tile(moon, {0, level, last, middle}, layers),
                   over = make_tile(moon, {2, level, middle, last}, layers);
    for (int n = 0; n <= tile_cells; ++n) {
        REQUIRE(a.at(tile_cells, n) == b.at(0, n));
        REQUIRE(edge.at(tile_cells, n) == over.at(n, tile_cells));
    }
    CHECK(make_tile(moon, a.key, layers).heights_m == a.heights_m);
    double covered = 0, checked = 0;
    for (const Boulder& boulder : boulders.near(a.cap, 1)) {
        double highest = 0;
        for (int j = 0; j <= tile_cells; ++j)
            for (int i = 0; i <= tile_cells; ++i)
                if (length(a.position(i, j) - boulder.position_m) < a.spacing_m)
                    highest = std::max(highest, a.at(i, j));
        if (highest == 0) continue;
        ++checked;
        CHECK(highest >= boulder.height_m * 0.9); // of its own, or of a higher one beside it
    }
    CHECK(checked > 0);
    for (const double height : a.heights_m)
        covered += height > 0 ? 1 : 0;
    // Ellipses of D x D / sqrt 2, N(>D) = 0.01 D^-2.482 from 0.3 m: 4 %, more on ejecta, less by overlap.
    CHECK(covered / static_cast<double>(tile_vertices) > 0.02);
    CHECK(covered / static_cast<double>(tile_vertices) < 0.2);
    for (std::uint64_t n = 0; n < 8; ++n)
        for (const int deep : {13, 15, 17})
            check_bounds(moon, boulders, deep, n);
}

} // namespace boulders_test
