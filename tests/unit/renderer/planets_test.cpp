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

using namespace obscura;
using namespace obscura::renderer;
using namespace obscura::test;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;
using Catch::Matchers::WithinRel;

namespace {

constexpr double pi = std::numbers::pi;
constexpr double degree = pi / 180;

/// A raster of a function of the direction.
template<typename F>
HeightMap map_of(std::int32_t height, double left_rad, F&& f) {
    std::vector<float> samples;
    for (std::int32_t j = 0; j < height; ++j)
        for (std::int32_t i = 0; i < 2 * height; ++i)
            samples.push_back(static_cast<float>(
                f(at_latitude((0.5 - (j + 0.5) / height) * pi, left_rad + (i + 0.5) / height * pi))));
    return {2 * height, height, std::move(samples), left_rad};
}

} // namespace

TEST_CASE("A height map is its function across its seam and its poles") {
    const auto f = [](Vec3 p) { return 1000 * (p.x * p.y + 0.7 * p.z * p.z * p.z - 0.4 * p.y); };
    const HeightMap map = map_of(180, 20 * degree, f);
    Directions any;
    for (int k = 0; k < 20000; ++k) {
        Vec3 p = any();
        if (k % 4 == 1)
            p = at_latitude(std::copysign(90 - 2 * any.number(), p.z) * degree, 360 * any.number());
        if (k % 4 == 2) p = at_latitude(pi * (any.number() - 0.5), (20 + 0.5 * any.number()) * degree);
        // Cubics leave a share of (step)^3 of third derivatives of some hundred metres.
        REQUIRE_THAT(map.at(2.5 * p), WithinAbs(f(p), 0.02));
    }
    // Samples are met at the middles of their pixels, of one degree.
    const Vec3 middle = at_latitude(0.5 * degree, 20.5 * degree);
    CHECK_THAT(map.at(middle), WithinAbs(static_cast<float>(f(middle)), 1e-9));
    CHECK_THAT(map.at({0, 0, 1}), WithinAbs(700, 0.02));
}

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
    p.height_file = write("heights.fits", 16, 8, 50);
    CHECK_THAT(distance_to(*shape_of(p), {0, 0, 2000}, {0, 0, -1}), WithinAbs(1150, 1e-3));
    CHECK_THAT(distance_to(*shape_of(p), {0, -2000, 0}, {0, 1, 0}), WithinAbs(1050, 1e-3));
    p.height_scale_m = 2;
    CHECK_THAT(distance_to(*shape_of(p), {2000, 0, 0}, {-1, 0, 0}), WithinAbs(900, 1e-3));
    p.height_scale_m = 1;
    p.height_file = write("radii.fits", 16, 8, 950);
    CHECK_THROWS_WITH(shape_of(p),
                      ContainsSubstring("radii.fits: heights up to 950 m on a body of radius 800 m; if "
                                        "they are distances from the centre, set height_values"));
    p.values = HeightMap::Values::radius;
    CHECK_THAT(distance_to(*shape_of(p), {0, 0, 2000}, {0, 0, -1}), WithinAbs(1050, 1e-3));
    p.height_file = write("square.fits", 8, 8, 950);
    CHECK_THROWS_WITH(shape_of(p), ContainsSubstring("square.fits: 8 x 8 pixels; a height map covers"));
    p.height_file = write("hole.fits", 16, 8, std::numeric_limits<float>::quiet_NaN());
    CHECK_THROWS_WITH(shape_of(p), ContainsSubstring("hole.fits: pixel 0, 0 has no height"));
    p.height_file = (folder.path() / "absent.fits").string();
    CHECK_THROWS_AS(shape_of(p), InputError);
}

TEST_CASE("The Moon of LOLA has its extremes where they are") {
    const auto file = data_file("dem_moon_lola_ldem4/LDEM_4.LBL");
    if (!file) return;
    ShapeContext context;
    PlanetParameters p;
    p.radii_m = {1737400, 1737400, 1737400};
    p.height_file = file->string();
    p.values = HeightMap::Values::radius;
    p.left_longitude_rad = 0;
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
