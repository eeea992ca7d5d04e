// SPDX-License-Identifier: Apache-2.0
// Map projections against PROJ, there and back, and the place of samples in maps of labels.
#include "terrain/geometry/map_frame.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace projection_test {

using namespace obscura;
using namespace obscura::terrain;
using Catch::Matchers::ContainsSubstring;
using Catch::Matchers::WithinAbs;

namespace {

constexpr double degree = std::numbers::pi / 180;
constexpr double moon_m = 1737400, mars_a_m = 3396190, mars_b_m = 3376200;

/// Direction of a longitude and a latitude of the spheroid's kind.
Vec3 direction(double longitude_deg, double latitude_deg, double b_over_a = 1) {
    const double latitude =
        std::atan2(b_over_a * b_over_a * std::sin(latitude_deg * degree), std::cos(latitude_deg * degree));
    return {std::cos(latitude) * std::cos(longitude_deg * degree),
            std::cos(latitude) * std::sin(longitude_deg * degree), std::sin(latitude)};
}

struct Case {
    double longitude_deg, latitude_deg, x_m, y_m;
};

void check(const Projection& projection, const std::vector<Case>& cases) {
    const bool spheroid = projection.latitudes == Latitudes::planetographic;
    const double flat = spheroid ? projection.polar_radius_m / projection.equatorial_radius_m : 1;
    for (const Case& c : cases) {
        CAPTURE(c.longitude_deg, c.latitude_deg);
        const Vec3 p = direction(c.longitude_deg, c.latitude_deg, flat);
        const MapPoint at = projection.forward(1234.5 * p);
        // Rounding of an angle is 1e-9 m of a radius of 3400 km already, and grows towards the far pole.
        const double tolerance = 2e-15 * std::hypot(c.x_m, c.y_m) + 3e-9;
        CHECK_THAT(at.x_m, WithinAbs(c.x_m, tolerance));
        CHECK_THAT(at.y_m, WithinAbs(c.y_m, tolerance));
        CHECK(length(projection.inverse({c.x_m, c.y_m}) - p) < 3e-15);
    }
}

} // namespace

// The figures of these cases are from PROJ 9.1.1: printf '10 20\n' | proj -f %.11f ARGUMENTS
TEST_CASE("Simple cylindrical maps are PROJ's eqc") {
    // +proj=eqc +R=1737400 +lon_0=30
    check(Projection::of_sphere(ProjectionKind::simple_cylindrical, moon_m, 30 * degree),
          {{10, 20, -606467.00848298951, 606467.00848298962},
           {-75.25, -61.5, -3191532.63214173261, -1864886.05108519318},
           {222.51, -89.463, -5078857.96254079603, -2712817.89899568493},
           {179.999, 5, 4548472.24027199764, 151616.75212074741},
           {-179.999, -33, 4548532.88697284646, -1000670.56399693293}});
    // +proj=eqc +R=3396190 +lon_0=180 +lat_ts=35
    Projection mars = Projection::of_sphere(ProjectionKind::simple_cylindrical, mars_a_m, 180 * degree);
    mars.true_scale_latitude_rad = 35 * degree;
    check(mars, {{10, 20, -8254348.24064074829, 1185493.95046612434},
                 {-75.25, -61.5, 5086135.16592422500, -3645393.89768333267},
                 {179.999, 5, -48.55498965132, 296373.48761653109}});
    // +proj=eqc +a=3396190 +b=3376200 +lon_0=-20: planetographic latitudes, on a sphere
    mars = Projection::of_sphere(ProjectionKind::simple_cylindrical, mars_a_m, -20 * degree);
    mars.polar_radius_m = mars_b_m;
    mars.latitudes = Latitudes::planetographic;
    check(mars, {{10, 20, 1778240.92569918651, 1185493.95046612434},
                 {222.51, -89.463, -6964184.21201324742, -5302892.26452754438}});
    // On Mars both kinds of latitude are up to 0.34 degrees, 20 km, apart.
    const Vec3 p = direction(0, 45);
    CHECK_THAT(mars.latitude_rad(p) / degree, WithinAbs(45.3382, 1e-3));
}

TEST_CASE("Polar stereographic maps are PROJ's stere") {
    // +proj=stere +lat_0=-90 +R=1737400 +lon_0=0
    const Projection south = Projection::of_sphere(ProjectionKind::south_polar_stereographic, moon_m);
    check(south, {{10, 20, 861734.06430299720, 4887136.73222686723},
                  {-75.25, -61.5, -853405.25478223583, 224682.85293706966},
                  {222.51, -89.463, -11003.24291635130, -12003.72576490529},
                  {-179.999, -33, -32.92847188874, -1886662.46481628530}});
    // The pole itself; lunar products state X = rho sin(longitude), Y = rho cos(longitude).
    CHECK(std::abs(south.forward({0, 0, -2}).x_m) < 1e-9);
    CHECK(length(south.inverse({0, 0}) - Vec3{0, 0, -1}) < 1e-15);
    // +proj=stere +lat_0=-90 +lat_ts=-71 +R=1737400 +lon_0=45
    Projection turned = Projection::of_sphere(ProjectionKind::south_polar_stereographic, moon_m, 45 * degree);
    turned.true_scale_latitude_rad = -71 * degree;
    check(turned, {{10, 20, -2768851.84567578370, 3954330.24436609540},
                   {-75.25, -61.5, -741557.17902360344, -432463.36487985443},
                   {222.51, -89.463, 688.17681367872, -15825.22121429345}});
    // +proj=stere +lat_0=-90 +lat_ts=-71 +a=3396190 +b=3376200
    Projection mars = Projection::of_sphere(ProjectionKind::south_polar_stereographic, mars_a_m);
    mars.polar_radius_m = mars_b_m;
    mars.latitudes = Latitudes::planetographic;
    mars.true_scale_latitude_rad = -71 * degree;
    check(mars, {{10, 20, 1622484.18638316006, 9201565.06885204837},
                 {-75.25, -61.5, -1630046.97734731832, 429155.55445612659},
                 {222.51, -89.463, -21046.96525412181, -22960.68541016496},
                 {-179.999, -33, -62.64732605825, -3589427.38049149513}});
    // +proj=stere +lat_0=90 +R=1737400 +lon_0=-60, +a=3396190 +b=3376200 +lon_0=10
    check(Projection::of_sphere(ProjectionKind::north_polar_stereographic, moon_m, -60 * degree),
          {{10, 20, 2286348.40597196575, -832162.76493577496},
           {222.51, 89.463, -15897.15291064543, -3527.22500711876},
           {179.999, -5, -3284003.46358203050, 1896096.70671962691}});
    mars = Projection::of_sphere(ProjectionKind::north_polar_stereographic, mars_a_m, 10 * degree);
    mars.polar_radius_m = mars_b_m;
    mars.latitudes = Latitudes::planetographic;
    check(mars, {{-75.25, 61.5, -1726815.06959561072, -143487.26727934889},
                 {222.51, 89.463, -17208.61344878384, 27001.71142511519}});
}

TEST_CASE("The scale of a projection is its derivative") {
    for (const ProjectionKind kind :
         {ProjectionKind::simple_cylindrical, ProjectionKind::north_polar_stereographic,
          ProjectionKind::south_polar_stereographic})
        for (const double latitude : {-70.0, -10.0, 0.0, 45.0, 80.0}) {
            const Projection projection = Projection::of_sphere(kind, moon_m, 30 * degree);
            const Vec3 p = direction(30, latitude);
            const double step = 1e-6;
            const Vec3 east = direction(30 + step / degree, latitude),
                       north = direction(30, latitude + step / degree);
            const MapPoint at = projection.forward(p), e = projection.forward(east),
                           n = projection.forward(north);
            const MapPoint scale = projection.metres_per_radian(p);
            const double arc = step * std::cos(latitude * degree);
            CHECK_THAT(std::hypot(e.x_m - at.x_m, e.y_m - at.y_m) / arc / scale.x_m, WithinAbs(1, 1e-5));
            CHECK_THAT(std::hypot(n.x_m - at.x_m, n.y_m - at.y_m) / step / scale.y_m, WithinAbs(1, 1e-5));
        }
    // At the pole, where a parallel has no length.
    const Projection south = Projection::of_sphere(ProjectionKind::south_polar_stereographic, moon_m);
    CHECK_THAT(south.metres_per_radian({0, 0, -1}).x_m, WithinAbs(moon_m, 1e-6));
}

TEST_CASE("The samples of a map lie where its label says") {
    // LDEM_4: 1440 x 720 pixels, row 0 at +89.875 degrees, column 0 at 0.125 E.
    const Projection moon = Projection::of_sphere(ProjectionKind::simple_cylindrical, moon_m);
    const MapFrame global =
        MapFrame::by_edges(moon, Registration::pixel, 1440, 720, 0, 360 * degree, 90 * degree, -90 * degree);
    const SamplePlace first = global.place(direction(0.125, 89.875));
    CHECK_THAT(first.x, WithinAbs(0, 1e-9));
    CHECK_THAT(first.y, WithinAbs(0, 1e-9));
    CHECK_THAT(global.place(direction(-0.125, 0)).x, WithinAbs(1439, 1e-9));
    CHECK_THAT(global.period(), WithinAbs(1440, 1e-9));
    CHECK(global.first_pole_y() == -0.5);
    CHECK(global.last_pole_y() == 719.5);
    CHECK(length(global.position({0, 0}) - direction(0.125, 89.875)) < 1e-14);
    CHECK_THAT(global.samples_per_radian(direction(77, 60)).x, WithinAbs(1440 / std::numbers::pi, 1e-9));

    // A part of the body: beside it, places are beside the raster on the nearer side.
    const MapFrame strip = MapFrame::by_edges(moon, Registration::pixel, 1024, 3071, 216 * degree,
                                              232 * degree, -42 * degree, -(42 + 3071 / 64.0) * degree);
    CHECK(strip.period() == 0);
    CHECK(std::isnan(strip.first_pole_y()));
    CHECK(std::isnan(strip.last_pole_y()));
    CHECK_THAT(strip.place(direction(216 + 0.5 / 64, -42 - 0.5 / 64)).x, WithinAbs(0, 1e-9));
    CHECK_THAT(strip.place(direction(215, -50)).x, WithinAbs(-64.5, 1e-9));
    CHECK_THAT(strip.place(direction(-120, -50)).x, WithinAbs(24 * 64 - 0.5, 1e-9));

    // Nodes, west positive: columns grow westwards, the first column is the last one's again.
    const MapFrame nodes = MapFrame::by_edges(moon, Registration::node, 361, 181, 180 * degree, -180 * degree,
                                              90 * degree, -90 * degree);
    CHECK_THAT(nodes.place(direction(179, 90 - 17)).x, WithinAbs(1, 1e-9));
    CHECK_THAT(nodes.place(direction(10, 90 - 17)).y, WithinAbs(17, 1e-9));
    CHECK_THAT(nodes.period(), WithinAbs(360, 1e-9));
    CHECK(nodes.first_pole_y() == 0);
    CHECK(nodes.last_pole_y() == 180);

    // A turned planar raster.
    const MapFrame turned({ProjectionKind::planar}, {100, 0, 2, 50, 2, 0}, Registration::pixel, 10, 20);
    CHECK_THAT(turned.place({101, 51, 7}).x, WithinAbs(0, 1e-12));
    CHECK_THAT(turned.place({105, 51, 7}).y, WithinAbs(2, 1e-12));
    CHECK(turned.position({0, 2}) == Vec3{105, 51, 0});
}

TEST_CASE("Maps that cannot be are refused") {
    const Projection moon = Projection::of_sphere(ProjectionKind::simple_cylindrical, moon_m);
    const auto frame = [&](const PixelTransform& t, std::int64_t width, std::int64_t height) {
        return MapFrame(moon, t, Registration::pixel, width, height);
    };
    const double step = moon.turn_m() / 100;
    CHECK_THROWS_WITH(frame({0, 0, 0, 0, 0, -1}, 4, 4), ContainsSubstring("cannot be inverted"));
    CHECK_THROWS_WITH(frame({0, step, 1, 0, 0, -step}, 4, 4), ContainsSubstring("do not follow parallels"));
    CHECK_THROWS_WITH(frame({0, step, 0, 25 * step, 0, -step}, 102, 50), ContainsSubstring("full turn"));
    CHECK_THROWS_WITH(frame({0, step, 0, 20 * step, 0, -step}, 100, 50), ContainsSubstring("crosses a pole"));
    CHECK_THROWS_AS(frame({NAN, step, 0, 25 * step, 0, -step}, 100, 50), std::invalid_argument);
}

} // namespace projection_test
