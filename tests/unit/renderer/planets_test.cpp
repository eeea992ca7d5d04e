// SPDX-License-Identifier: Apache-2.0
// Planets with height maps: interpolation, keys of a scene and the Moon's own extremes.
#include "core/error.hpp"
#include "images/writers/fits.hpp"
#include "renderer/planets/planet_parameters.hpp"
#include "support.hpp"
#include "terrain_support.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/temp_folder.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

namespace planets_test {

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

} // namespace

TEST_CASE("A scene's planet takes heights or radii, and says what is wrong with a file") {
    const TempFolder folder;
    const auto write = [&](const char* name, std::int32_t width, std::int32_t height, float value) {
        const std::vector<float> samples(static_cast<std::size_t>(width) * static_cast<std::size_t>(height),
                                         value);
        images::write_fits_float(folder.path() / name, width, height, 1, samples, "", {});
        return (folder.path() / name).string();
    };
    const auto shape_of = [](PlanetParameters p) {
        ShapeContext context;
        context.place = "body 'moon'";
        return make(p, context);
    };
    PlanetParameters p;
    p.radii_m = {1000, 900, 800};
    CHECK_THAT(distance_to(*shape_of(p), {0, 0, 2000}, {0, 0, -1}), WithinAbs(1200, 1e-3)); // no map
    p.relief.heights = {whole_body_map(write("heights.fits", 16, 8, 50))};
    CHECK_THAT(distance_to(*shape_of(p), {0, 0, 2000}, {0, 0, -1}), WithinAbs(1150, 1e-3));
    CHECK_THAT(distance_to(*shape_of(p), {0, -2000, 0}, {0, 1, 0}), WithinAbs(1050, 1e-3));
    // One on the range of the map.
    REQUIRE(shape_of(p)->notes().size() == 1);
    CHECK_THAT(shape_of(p)->notes()[0], ContainsSubstring("heights.fits"));
    p.relief.heights[0].map.scale_m = 2;
    CHECK_THAT(distance_to(*shape_of(p), {2000, 0, 0}, {-1, 0, 0}), WithinAbs(900, 1e-3));
    p.relief.heights = {whole_body_map(write("radii.fits", 16, 8, 950))};
    CHECK_THROWS_WITH(shape_of(p),
                      ContainsSubstring("radii.fits: heights from 950 to 950 m on a body of radius 800 m; if "
                                        "they are distances from the centre, set values"));
    p.relief.heights[0].map.meaning = terrain::HeightMeaning::radius;
    CHECK_THAT(distance_to(*shape_of(p), {0, 0, 2000}, {0, 0, -1}), WithinAbs(1050, 1e-3));
    p.relief.heights[0].map.projection.reset();
    CHECK_THROWS_WITH(shape_of(p), ContainsSubstring("radii.fits: the file has no label with its place"));
    p.relief.heights = {whole_body_map(write("hole.fits", 16, 8, std::numeric_limits<float>::quiet_NaN()))};
    CHECK_THROWS_WITH(shape_of(p), ContainsSubstring("hole.fits: no pixel has data"));
    p.relief.heights = {whole_body_map((folder.path() / "absent.fits").string())};
    CHECK_THROWS_AS(shape_of(p), InputError);
    // A patch over a map, whose overlap is stated.
    p.relief.heights = {whole_body_map(write("heights.fits", 16, 8, 50)),
                        whole_body_map(write("patch.fits", 40, 40, 60))};
    HeightTable& patch = p.relief.heights[1];
    patch.map.left_rad = -0.2;
    patch.map.right_rad = 0.2;
    patch.map.top_rad = 0.2;
    patch.map.bottom_rad = -0.2;
    patch.priority = 1;
    patch.feather_m = 20;
    CHECK_THAT(distance_to(*shape_of(p), {2000, 0, 0}, {-1, 0, 0}), WithinAbs(940, 1e-3));
    CHECK_THAT(distance_to(*shape_of(p), {-2000, 0, 0}, {1, 0, 0}), WithinAbs(950, 1e-3));
    REQUIRE(shape_of(p)->notes().size() == 3); // two on the maps, then the overlap
    CHECK_THAT(shape_of(p)->notes()[2], ContainsSubstring("mean 10.00 m, rms 10.00 m; blended over 20 m"));
    // A plane, with and without a map.
    TerrainParameters plane;
    plane.half_edge_m = 50;
    ShapeContext context;
    CHECK_THAT(distance_to(*make(plane, context), {10, 20, 30}, {0, 0, -1}), WithinAbs(30, 1e-9));
    HeightTable ground;
    ground.file = write("ground.fits", 20, 20, 4);
    ground.map.projection = terrain::ProjectionKind::planar;
    ground.map.left_m = -50;
    ground.map.top_m = 50;
    ground.map.pixel_m = 5;
    plane.relief.heights = {ground};
    CHECK_THAT(distance_to(*make(plane, context), {10, 20, 30}, {0, 0, -1}), WithinAbs(26, 1e-3));
    CHECK_THAT(distance_to(*make(plane, context), {-49.9, 49.9, 30}, {0, 0, -1}), WithinAbs(26, 1e-3));
    plane.half_edge_m = 51;
    CHECK_THROWS_WITH(make(plane, context), ContainsSubstring("ground.fits: does not cover the corner"));
}

TEST_CASE("The Moon of LOLA has its extremes where they are") {
    const auto file = data_file("dem_moon_lola_ldem4/LDEM_4.LBL");
    if (!file) return;
    ShapeContext context;
    PlanetParameters p;
    p.radii_m = {1737400, 1737400, 1737400};
    p.relief.heights.emplace_back();
    p.relief.heights[0].file = file->string();
    const std::shared_ptr<const Shape> moon = make(p, context);
    const auto altitude = [&](double latitude_deg, double longitude_deg) {
        const Vec3 up = at_latitude(latitude_deg * degree, longitude_deg * degree);
        return 2e6 - distance_to(*moon, 2e6 * up, -up) - 1737400;
    };
    // The highest point, 10.8 km, and the floor of Antoniadi, -9.2 km (Smith et al., Geophysical Research
    // Letters 37, L18204, 2010); a grid of 7.6 km shows less of either. Mare Orientale, Tycho's peak.
    CHECK_THAT(altitude(5.44, 201.37), WithinAbs(10500, 400));
    CHECK_THAT(altitude(-70.38, 187.5), WithinAbs(-8800, 400));
    CHECK(altitude(-19.4, 267.2) < -2000);
    CHECK(altitude(-19.4, 267.2) < altitude(-19.4, 255) - 3000);
    CHECK(moon->bounding_radius_m() > 1747500);
    CHECK(moon->bounding_radius_m() < 1755000); // a bound of cubics, not of their values
}

} // namespace planets_test
