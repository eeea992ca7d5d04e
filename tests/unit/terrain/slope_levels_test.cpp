// SPDX-License-Identifier: Apache-2.0
// Slopes that maps lose on coarse cells, against those of the same map on finer ones.
#include "terrain/maps/height_stack.hpp"
#include "terrain/maps/memory_pyramid.hpp"
#include "terrain/maps/slope_levels.hpp"
#include "tests/support/catch.hpp"
#include "tests/unit/terrain/made_tiles.hpp"

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <random>

namespace slope_levels_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr std::int64_t size = 1024;
/// Pixels of a metre.
const SurfaceDomain domain = SurfaceDomain::plane(size / 2.0);

/// Waves of 5 to 80 pixels in all directions, steeper for x above 0.
std::vector<float> rough_samples() {
    std::mt19937_64 engine(3);
    std::uniform_real_distribution<double> random(0, 1);
    std::vector<std::array<double, 4>> waves;
    for (int n = 0; n < 48; ++n) {
        const double length = 5 * std::exp2(4 * random(engine)), turn = 2 * std::numbers::pi * random(engine);
        const double k = 2 * std::numbers::pi / length;
        waves.push_back({k * std::cos(turn), k * std::sin(turn), 7 * random(engine), 0.02 / k});
    }
    std::vector<float> samples;
    for (std::int64_t j = 0; j < size; ++j)
        for (std::int64_t i = 0; i < size; ++i) {
            double height = 0;
            for (const auto& [kx, ky, phase, amplitude] : waves)
                height +=
                    amplitude * std::sin(kx * static_cast<double>(i) + ky * static_cast<double>(j) + phase);
            samples.push_back(static_cast<float>(height * (i < size / 2 ? 1 : 2)));
        }
    return samples;
}

std::shared_ptr<const RasterLayer> layer_of() {
    Projection projection;
    projection.kind = ProjectionKind::planar;
    const double half = size / 2.0;
    const MapFrame frame(projection, {-half, 1, 0, half, 0, -1}, Registration::pixel, size, size);
    return std::make_shared<const RasterLayer>(
        domain, HeightRaster{std::make_shared<const Raster>(
                    std::make_shared<const MemoryPyramid>(size, size, rough_samples()), frame)});
}

/// Mean over a square of the plane of the squared slope of shading normals at their vertices and of what is
/// lost, on cells of a level.
std::array<double, 2> slopes(const RasterLayer& layer, int level, double x0, double x1) {
    std::array<double, 2> sums{};
    double count = 0;
    const std::uint32_t tiles = 1u << level;
    for (std::uint32_t j = 0; j < tiles; ++j)
        for (std::uint32_t i = 0; i < tiles; ++i) {
            const HeightLayer* const layers[] = {&layer};
            const MadeTile tile = make_tile(domain, {0, static_cast<std::uint8_t>(level), i, j}, layers);
            for (int b = 8; b < tile_cells; b += 2)
                for (int a = 8; a < tile_cells; a += 2) {
                    const Vec3 p = tile.position(a, b);
                    if (p.x < x0 || p.x > x1 || std::abs(p.y) > 400) continue;
                    // As kept_squared_slope() weighs the vertices of a cell.
                    for (const auto& [u, v] : {std::pair{1, 0}, std::pair{0, 1}}) {
                        const auto slope = [&, du = u, dv = v](int column, int row) {
                            return (tile.at(column + du, row + dv) - tile.at(column - du, row - dv)) /
                                   (2 * tile.spacing_m);
                        };
                        const double s = slope(a, b);
                        sums[0] += s *
                                   (4 * s + 4 * slope(a - 1, b) * 0.5 + 4 * slope(a, b - 1) * 0.5 +
                                    slope(a - 1, b - 1)) /
                                   9;
                    }
                    const std::array<Vec3, 1> position{p};
                    const std::array<double, 1> samples{1};
                    std::array<double, 1> lost{};
                    layer.add_lost_slopes(position, tile.spacing_m, samples, lost);
                    sums[1] += lost[0];
                    ++count;
                }
        }
    return {sums[0] / count, sums[1] / count};
}

} // namespace

TEST_CASE("What a map loses on coarse cells is what it has more on finer ones", "[terrain]") {
    const auto layer = layer_of();
    for (const auto& [x0, x1] : {std::pair{-400.0, -50.0}, std::pair{50.0, 400.0}}) {
        const auto fine = slopes(*layer, 3, x0, x1); // cells of half a pixel
        for (const int level : {0, 1, 2}) {
            const auto coarse = slopes(*layer, level, x0, x1);
            INFO("cells of " << domain.spacing_m(level) << " pixels: kept " << coarse[0] << ", lost "
                             << coarse[1] << "; of half a pixel " << fine[0] << ", " << fine[1]);
            CHECK_THAT(coarse[0] + coarse[1], WithinRel(fine[0] + fine[1], 0.1));
            CHECK(coarse[1] > 2 * fine[1]);
        }
    }
}

TEST_CASE("Patches have the lost slopes of what is seen of them", "[terrain]") {
    const auto layer = layer_of();
    const std::array<Vec3, 2> positions{Vec3{-200, 0, 0}, Vec3{200, 0, 0}};
    const std::array<double, 2> samples{1, 1};
    std::array<double, 2> lost{5, 5}; // of what it hides
    layer->add_lost_slopes(positions, 8, samples, lost);
    CHECK(lost[0] > 0);
    CHECK(lost[1] > 2 * lost[0]);
    CHECK(lost[1] < 1);
}

TEST_CASE("A map of a whole body loses as much towards its poles and across its seam", "[terrain]") {
    constexpr std::int64_t rows = 256;
    const MapFrame frame = MapFrame::by_edges(Projection::of_sphere(ProjectionKind::simple_cylindrical, 1000),
                                              Registration::pixel, 2 * rows, rows, 0, 2 * std::numbers::pi,
                                              std::numbers::pi / 2, -std::numbers::pi / 2);
    // Waves of 6 pixels through space in many directions: alike everywhere on the sphere.
    std::mt19937_64 engine(5);
    std::normal_distribution<double> random;
    std::vector<std::pair<Vec3, double>> waves;
    const double k = 2 * std::numbers::pi / (6 * std::numbers::pi / rows);
    for (int n = 0; n < 400; ++n) {
        const Vec3 direction = normalized(Vec3{random(engine), random(engine), random(engine)});
        waves.emplace_back(k * direction, 7 * random(engine));
    }
    std::vector<float> samples;
    for (std::int64_t j = 0; j < rows; ++j)
        for (std::int64_t i = 0; i < 2 * rows; ++i) {
            const Vec3 p = frame.position({static_cast<double>(i), static_cast<double>(j)});
            double height = 0;
            for (const auto& [wave, phase] : waves)
                height += std::sin(dot(wave, p) + phase);
            samples.push_back(static_cast<float>(height));
        }
    const SlopeLevels levels(MemoryPyramid(2 * rows, rows, std::move(samples)), frame);
    const double x = rows / 2.0, middle = rows / 2.0;
    double mean = 0;
    for (int n = 0; n < 16; ++n)
        mean += levels.lost({n * rows / 8.0, middle}, 4) / 16;
    CHECK(mean > 0);
    for (const double y : {3.0, 20.0, middle, rows - 20.0})
        CHECK_THAT(levels.lost({x, y}, 4), WithinRel(mean, 0.4));
    CHECK_THAT(levels.lost({-0.5, 70}, 4), WithinRel(levels.lost({2 * rows - 0.5, 70}, 4), 1e-9));
    CHECK(levels.lost({x, middle}, 0.1) < 0.02 * mean);
}

} // namespace slope_levels_test
