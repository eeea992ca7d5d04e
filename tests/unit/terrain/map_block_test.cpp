// SPDX-License-Identifier: Apache-2.0
// Maps sampled at many positions at once: against single positions, on all sets of vector instructions, and
// at the vertices that tiles share.
#include "made_tiles.hpp"
#include "terrain/maps/height_stack.hpp"
#include "terrain/maps/memory_pyramid.hpp"
#include "terrain/tiles/tile_maker.hpp"
#include "tests/support/catch.hpp"

#include <hwy/targets.h>

#include <cmath>
#include <cstring>
#include <numbers>
#include <random>

namespace map_block_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;
constexpr double moon_m = 1737400;

class Random {
public:
    double number() { return uniform_(engine_); }
    /// Uniform over the sphere; one in eight within 1e-3 rad of a pole or of the date line.
    Vec3 direction() {
        const double choice = number(),
                     turn = choice < 0.06 ? pi + 1e-3 * (2 * number() - 1) : 2 * pi * number();
        double z = 2 * number() - 1;
        if (choice > 0.94) z = std::copysign(std::cos(1e-3 * number()), z);
        const double rho = std::sqrt(1 - z * z);
        return {rho * std::cos(turn), rho * std::sin(turn), z};
    }

private:
    std::mt19937_64 engine_{5};
    std::uniform_real_distribution<double> uniform_{0, 1};
};

std::shared_ptr<const Raster> noise(const MapFrame& frame, unsigned seed) {
    std::mt19937_64 engine(seed);
    std::uniform_real_distribution<float> uniform(-3000, 3000);
    std::vector<float> samples(static_cast<std::size_t>(frame.width() * frame.height()));
    for (float& v : samples)
        v = uniform(engine);
    return std::make_shared<const Raster>(
        std::make_shared<const MemoryPyramid>(frame.width(), frame.height(), std::move(samples)), frame);
}

MapFrame global(std::int64_t width) {
    return MapFrame::by_edges(Projection::of_sphere(ProjectionKind::simple_cylindrical, moon_m),
                              Registration::pixel, width, width / 2, 0, 360 * degree, 90 * degree,
                              -90 * degree);
}

MapFrame polar(ProjectionKind kind, double centre_rad) {
    return {Projection::of_sphere(kind, moon_m, centre_rad),
            {-1.5e6, 3000, 20, 1.6e6, -10, -2900},
            Registration::pixel,
            1000,
            1050};
}

/// Maps of all kinds, turned, of spheres and of spheroids, with parallels of true scale.
std::vector<MapFrame> frames() {
    std::vector<MapFrame> all{global(1440), polar(ProjectionKind::south_polar_stereographic, 0.3),
                              polar(ProjectionKind::north_polar_stereographic, -2)};
    Projection mars = Projection::of_sphere(ProjectionKind::simple_cylindrical, 3396190, 2.5);
    mars.polar_radius_m = 3376200;
    mars.latitudes = Latitudes::planetographic;
    mars.true_scale_latitude_rad = 35 * degree;
    all.emplace_back(mars, PixelTransform{-4e6, 1000, 0, 3e6, 0, -1100}, Registration::node, 7000, 5000);
    mars.kind = ProjectionKind::south_polar_stereographic;
    mars.true_scale_latitude_rad = -70 * degree;
    all.emplace_back(mars, PixelTransform{-1e6, 1000, 0, 1e6, 0, -1000}, Registration::pixel, 2000, 2000);
    mars.latitudes = Latitudes::planetocentric;
    all.emplace_back(mars, PixelTransform{-1e6, 1000, 0, 1e6, 0, -1000}, Registration::pixel, 2000, 2000);
    return all;
}

template<typename Use>
void with_all_targets(const Use& use) {
    for (const std::int64_t target : hwy::SupportedAndGeneratedTargets()) {
        hwy::SetSupportedTargetsForTest(target);
        hwy::GetChosenTarget().Update(target);
        INFO(hwy::TargetName(target));
        use();
    }
    hwy::SetSupportedTargetsForTest(0);
    hwy::GetChosenTarget().Update(hwy::SupportedTargets());
}

} // namespace

TEST_CASE("Places of many positions are those of each, up to rounding") {
    for (const MapFrame& frame : frames()) {
        Random random;
        for (int k = 0; k < 200; ++k) {
            std::vector<Vec3> positions;
            for (std::size_t n = 0; n < 1 + static_cast<std::size_t>(k) % map_block_size; ++n)
                positions.push_back(moon_m * random.direction());
            MapBlock block;
            block.load(positions);
            frame.locate(block);
            for (std::size_t n = 0; n < positions.size(); ++n) {
                const SamplePlace at = frame.place(positions[n]),
                                  density = frame.samples_per_radian(positions[n]);
                if (!(std::max(std::abs(at.x), std::abs(at.y)) < 1e4)) continue; // about the other pole
                // A millionth of a metre of a slope of 45 degrees is 1e-9 pixels of a kilometre. Half a turn
                // from a map's middle is on both its sides.
                const double turn = frame.projection().turn_m() / std::abs(frame.transform()[1]);
                double away = std::abs(block.place_x[n] - at.x);
                if (turn > 0) away = std::min(away, std::abs(away - turn));
                REQUIRE_THAT(away, WithinAbs(0, 1e-10 + 1e-14 * std::abs(at.x)));
                REQUIRE_THAT(block.place_y[n], WithinAbs(at.y, 1e-10 + 1e-14 * std::abs(at.y)));
                REQUIRE_THAT(block.density_x[n] / density.x, WithinAbs(1, 1e-9));
                REQUIRE_THAT(block.density_y[n] / density.y, WithinAbs(1, 1e-9));
            }
        }
        // The poles themselves.
        for (const double z : {moon_m, -moon_m}) {
            const Vec3 pole{0, 0, z};
            MapBlock block;
            block.load({&pole, 1});
            frame.locate(block);
            const SamplePlace at = frame.place(pole);
            if (std::abs(at.y) < 1e5) CHECK_THAT(block.place_y[0], WithinAbs(at.y, 1e-9));
        }
    }
}

TEST_CASE("A raster gives many positions what it gives each, bit for bit, on all sets of instructions") {
    const auto raster = noise(global(720), 3);
    Random random;
    std::vector<double> first;
    with_all_targets([&] {
        random = Random();
        Raster::Reader together(*raster), alone(*raster);
        std::vector<double> found;
        for (int k = 0; k < 300; ++k) {
            // Near each other, over footprints below and above a pixel.
            const Vec3 centre = random.direction();
            std::vector<Vec3> positions;
            std::array<double, map_block_size> footprints{}, values{};
            for (std::size_t n = 0; n < 1 + 7 * static_cast<std::size_t>(k) % map_block_size; ++n) {
                positions.push_back(moon_m * normalized(centre + 0.1 * random.direction()));
                footprints[n] = k % 5 == 0 ? 0 : 0.02 * random.number() * random.number();
            }
            MapBlock block;
            block.load(positions);
            raster->frame().locate(block);
            together.sample(block, footprints, values);
            for (std::size_t n = 0; n < positions.size(); ++n) {
                const double wanted = alone.sample(
                    {{block.place_x[n], block.place_y[n]}, {block.density_x[n], block.density_y[n]}},
                    footprints[n]);
                REQUIRE(values[n] == wanted);
                found.push_back(wanted);
            }
        }
        if (first.empty()) first = found;
        CHECK(std::memcmp(first.data(), found.data(), first.size() * sizeof(double)) == 0);
    });
}

TEST_CASE("A layer gives tiles the heights that it gives single positions, within a micrometre") {
    // Mountains of 3 km a pixel: any error of a place is one of the height.
    const SurfaceDomain domain = SurfaceDomain::ellipsoid({moon_m, moon_m, moon_m});
    const RasterLayer layer(domain, {noise(global(360), 8)});
    Raster::Reader reader(layer.raster());
    const HeightLayer* const layers[] = {&layer};
    for (std::uint64_t number = 0; number < 60; ++number) {
        const int level = 1 + static_cast<int>(number % 9);
        // The middle of a face at its poles, and the date line, among them.
        const TileKey key =
            number < 8    ? TileKey{static_cast<std::uint8_t>(number < 4 ? 4 : 5),
                                 static_cast<std::uint8_t>(level), 1u << (level - 1), 1u << (level - 1)}
            : number < 12 ? TileKey{1, static_cast<std::uint8_t>(level), 1u << (level - 1), 1}
                          : tile_of_number(domain, level, number);
        const MadeTile tile = make_tile(domain, key, layers);
        double worst = 0;
        for (std::size_t k = 0; k < tile.positions_m.size(); k += 131)
            worst = std::max(worst, std::abs(tile.heights_m[k] -
                                             layer.height_m(reader, tile.positions_m[k], tile.spacing_m)));
        INFO("level " << level << ", tile " << key.i << ", " << key.j << " of face " << int{key.face});
        REQUIRE(worst < 1e-6);
    }
}

TEST_CASE("Tiles share the vertices of their borders, bit for bit, on all sets of instructions") {
    const SurfaceDomain domain = SurfaceDomain::ellipsoid({moon_m, 0.98 * moon_m, 0.95 * moon_m});
    std::vector<HeightSource> sources(2);
    sources[0] = {"base", {noise(global(360), 1)}};
    sources[1] = {"patch", {noise(polar(ProjectionKind::south_polar_stereographic, 0.3), 2)}, 1, 30000};
    const TileMaker maker(domain, make_height_stack(domain, std::move(sources)).layers);
    TileMaker::Scratch scratch;
    auto tile = std::make_unique<SurfaceTile>(), neighbour = std::make_unique<SurfaceTile>();
    std::vector<float> first;
    with_all_targets([&] {
        std::vector<float> made;
        for (const int level : {1, 3, 6})
            for (std::uint64_t number = 0; number < 12; ++number) {
                TileKey key = tile_of_number(domain, level, number);
                if (number % 3 == 0) key.face = 5; // the patch
                if (key.i + 1 == 1u << level) --key.i;
                REQUIRE(maker.make(key, scratch, *tile) == 0);
                ++key.i;
                REQUIRE(maker.make(key, scratch, *neighbour) == 0);
                int wrong = 0;
                for (int j = -1; j <= tile_cells + 1; ++j)
                    for (int i = -1; i <= 1; ++i)
                        wrong += tile->height_m(tile_cells + i, j) != neighbour->height_m(i, j) ? 1 : 0;
                REQUIRE(wrong == 0);
                made.insert(made.end(), tile->heights.begin(), tile->heights.end());
                made.insert(made.end(), tile->maxima.begin(), tile->maxima.end());
            }
        if (first.empty()) first = made;
        CHECK(first == made);
    });
    // Faces 0 (x) and 4 (z) meet where z = x: at v = 1 of the one and u = 1 of the other, whose u runs along
    // x; both v, u of the other axis run along y.
    maker.make({0, 2, 1, 3}, scratch, *tile);
    maker.make({4, 2, 3, 1}, scratch, *neighbour);
    int wrong = 0;
    for (int k = 0; k <= tile_cells; ++k)
        wrong += tile->height_m(k, tile_cells) != neighbour->height_m(tile_cells, k) ? 1 : 0;
    CHECK(wrong == 0);
}

TEST_CASE("Heights beyond the bounds of their layer are counted") {
    class Wrong final : public HeightLayer {
    public:
        void apply(const VertexGrid& grid, std::span<double> heights_m,
                   std::span<double> /*sample_spacings_m*/) const override {
            for (std::size_t k = 0; k < grid.positions_m.size(); ++k)
                heights_m[k] = k == 7 ? 200 : k == 67000 ? std::nan("") : k == 67080 ? -200 : 50;
        }
        [[nodiscard]] HeightRange range(const Cap& /*cap*/, double /*spacing_m*/,
                                        HeightRange /*below*/) const override {
            return {-100, 100};
        }
    };
    const TileMaker maker(SurfaceDomain::plane(1000), {std::make_shared<const Wrong>()});
    TileMaker::Scratch scratch;
    const auto tile = std::make_unique<SurfaceTile>();
    CHECK(maker.make({0, 2, 1, 1}, scratch, *tile) == 3);
    CHECK_THAT(tile->height_m(6, -1), WithinAbs(100, 0.1));
}

} // namespace map_block_test
