// SPDX-License-Identifier: Apache-2.0
// Heights of layers as samples of maps, against the layers' own formula.
#include "terrain/geometry/map_frame.hpp"
#include "tests/support/catch.hpp"
#include "tools/scene/terrain_source.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace terrain_source_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::WithinAbs;
using obscura::tools::TerrainSource;

namespace {

/// Waves of 300 m amplitude, smooth everywhere.
double waves_m(Vec3 p) {
    return 200 * std::sin(p.x / 90e3) * std::cos(p.y / 70e3) + 100 * std::sin(p.z / 50e3);
}

class Waves final : public HeightLayer {
public:
    void apply(const VertexGrid& grid, std::span<double> heights_m,
               std::span<double> spacings_m) const override {
        for (std::size_t k = 0; k < heights_m.size(); ++k) {
            heights_m[k] = waves_m(grid.positions_m[k]);
            spacings_m[k] = 1;
        }
    }
    [[nodiscard]] HeightRange range(const Cap& /*cap*/, double /*spacing_m*/,
                                    HeightRange /*below*/) const override {
        HeightRange range;
        range.least = -300;
        range.largest = 300;
        return range;
    }
};

class Broken final : public HeightLayer {
public:
    void apply(const VertexGrid& /*grid*/, std::span<double> /*heights*/,
               std::span<double> /*spacings*/) const override {
        throw std::runtime_error("the layer failed");
    }
    [[nodiscard]] HeightRange range(const Cap& /*cap*/, double /*spacing_m*/,
                                    HeightRange below) const override {
        return below;
    }
};

double worst(const SurfaceDomain& domain, const MapFrame& frame, double spacing_m, std::int64_t x,
             std::int64_t y) {
    const TileMaker maker(domain, {std::make_shared<const Waves>()});
    TerrainSource source(maker, frame, spacing_m);
    constexpr int columns = 150, rows = 140;
    std::vector<float> out(std::size_t{columns} * rows);
    source.read(0, x, y, columns, rows, out);
    double largest = 0;
    for (int j = 0; j < rows; ++j)
        for (int i = 0; i < columns; ++i) {
            Vec3 p = frame.position({static_cast<double>(x + i), static_cast<double>(y + j)});
            if (!domain.is_plane()) {
                const Vec3 r = domain.radii_m();
                p = p / length(Vec3{p.x / r.x, p.y / r.y, p.z / r.z});
            }
            const auto got = static_cast<double>(out[static_cast<std::size_t>(j * columns + i)]);
            largest = std::max(largest, std::abs(got - waves_m(p)));
        }
    return largest;
}

} // namespace

TEST_CASE("A baked map has the heights of the terrain: over the seam, corners of the cube and poles") {
    // Triaxial: the direction from the centre is not that of the cube sphere.
    const Vec3 radii{1.74e6, 1.70e6, 1.65e6};
    const SurfaceDomain domain = SurfaceDomain::ellipsoid(radii);
    const double spacing_m = 4000;
    const auto columns = static_cast<std::int64_t>(2 * std::numbers::pi * radii.x / spacing_m);
    const MapFrame whole = MapFrame::by_edges(
        Projection::of_sphere(ProjectionKind::simple_cylindrical, radii.x), Registration::pixel, columns,
        columns / 2, -std::numbers::pi, std::numbers::pi, std::numbers::pi / 2, -std::numbers::pi / 2);
    // Cells of 2 km, waves of 314 km and more: cubics are good to a few centimetres, as are the steps of the
    // tiles' heights, 2^-14 of a cell; at the edges of faces the lines of vertices bend.
    for (const std::int64_t x : {std::int64_t{0}, columns / 8 - 70, columns / 2, columns - 150})
        for (const std::int64_t y : {std::int64_t{0}, columns / 5, columns / 2 - 140})
            CHECK(worst(domain, whole, spacing_m, x, y) < 0.15);
    const MapFrame pole(Projection::of_sphere(ProjectionKind::south_polar_stereographic, radii.x),
                        {-75 * spacing_m, spacing_m, 0, 70 * spacing_m, 0, -spacing_m}, Registration::pixel,
                        150, 140);
    CHECK(worst(domain, pole, spacing_m, 0, 0) < 0.15);
}

TEST_CASE("A baked plane has the heights of the terrain") {
    const SurfaceDomain domain = SurfaceDomain::plane(300e3);
    Projection planar;
    planar.kind = ProjectionKind::planar;
    const MapFrame frame(planar, {-300e3, 4000, 0, 300e3, 0, -4000}, Registration::pixel, 150, 150);
    CHECK(worst(domain, frame, 4000, 0, 0) < 0.15);
}

TEST_CASE("What a layer throws ends the bake") {
    const SurfaceDomain domain = SurfaceDomain::plane(300e3);
    const TileMaker maker(domain, {std::make_shared<const Broken>()});
    Projection planar;
    planar.kind = ProjectionKind::planar;
    TerrainSource source(
        maker, MapFrame(planar, {-300e3, 4000, 0, 300e3, 0, -4000}, Registration::pixel, 150, 150), 4000);
    std::vector<float> out(150 * 150);
    CHECK_THROWS_WITH(source.read(0, 0, 0, 150, 150, out), "the layer failed");
}

} // namespace terrain_source_test
