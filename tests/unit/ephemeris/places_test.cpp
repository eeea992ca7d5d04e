// SPDX-License-Identifier: Apache-2.0
// Astrometric and apparent places against python3-skyfield, and the geometry of a real frame's header.
#include "ephemeris/kernels/apparent_place.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/de405_states.hpp"

#include <array>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <string>
#include <vector>

namespace places_test {

using namespace obscura;
using obscura::test::angle;
using namespace obscura::ephemeris;

namespace {

constexpr double deg = std::numbers::pi / 180;
constexpr double mas = deg / 3.6e6;

} // namespace

TEST_CASE("Astrometric and apparent places agree with python3-skyfield to a milliarcsecond") {
    const auto file = test::data_file("ephemeris/de405_2000-2050.bsp");
    if (!file) return;
    const Ephemeris kernels({*file});
    struct Case {
        int target, observer;
        TdbTime time;
        Vec3 astrometric, aberrated, apparent;
    };
    // skyfield 1.45: observe(), add_aberration(), and add_deflection() by the Sun alone before it. The Sun
    // deflects by up to 26 mas in these cases.
    constexpr std::array cases{
        Case{301,
             399,
             {765958887, 0.35999999999999999},
             {0.82908151985550305, 0.50049912562952048, 0.249247785703654},
             {0.82913509590348999, 0.50042579199057435, 0.249216812136976},
             {0.82913509590026568, 0.50042579199466131, 0.24921681213949631}},
        Case{4,
             399,
             {644232960, 0.5},
             {0.95211578405843256, -0.2614526748061326, -0.15848669528864301},
             {0.95211476823287966, -0.26145772341252593, -0.15848446921004292},
             {0.95211476574202458, -0.26145773059019484, -0.15848447233289026}},
        Case{2,
             399,
             {225936001, 0.25},
             {0.98842153825638823, 0.1439788331670783, 0.047884844269576954},
             {0.98843464040872042, 0.14390040946536148, 0.047850118033134138},
             {0.98843463621111904, 0.14390043487428689, 0.047850128329856412}},
        Case{1,
             399,
             {1162583712, 0},
             {-0.66486614475662242, -0.68091865261179407, -0.30708760652589839},
             {-0.66494040588724279, -0.68085794145465095, -0.30706142736697484},
             {-0.66494033408133568, -0.68085799675989034, -0.30706146023216685}},
        Case{5,
             399,
             {557763840, 0.125},
             {-0.92481192683205826, -0.35616080054318167, -0.13368763647254556},
             {-0.92484059390046558, -0.35609719796989608, -0.13365875007579123},
             {-0.92484057709407941, -0.35609723585231573, -0.1336587654388241}},
        Case{6,
             399,
             {400000000, 0.75},
             {-0.89523759256310365, -0.42315386060432569, -0.13960824874438305},
             {-0.89526908415376838, -0.42309642923311952, -0.13958036584225078},
             {-0.8952690649208257, -0.42309646539213863, -0.13958037959709563}},
        Case{399,
             4,
             {900000123, 0.5},
             {-0.14538924236693326, -0.90556503249601716, -0.39851466738936525},
             {-0.1454637719594313, -0.90555595486146179, -0.39850809736099541},
             {-0.14546373843740615, -0.90555595954085755, -0.39850809896393663}},
        Case{10,
             5,
             {700000000, 0},
             {-0.9653926377533909, 0.23037628414702874, 0.12224492903248593},
             {-0.96538083408758735, 0.2304167024387084, 0.12226196634123827},
             {-0.96538083408758735, 0.2304167024387084, 0.12226196634123827}},
        Case{8,
             399,
             {1508172480, 0.5},
             {0.63927441021194298, 0.71748383101445412, 0.27666799721144925},
             {0.63920571222842493, 0.71753577117955492, 0.27669202108538199},
             {0.63920571578952667, 0.71753576835939314, 0.2766920201720573}},
        Case{2,
             1,
             {815000000, 0.25},
             {-0.93700142844722123, 0.27579637140119462, 0.21439376065968252},
             {-0.93695291869120467, 0.27591621148914752, 0.21445156188171957},
             {-0.93695296149792195, 0.27591611041177722, 0.21445150490381132}},
    };
    for (const Case& c : cases) {
        CAPTURE(c.target, c.observer);
        const auto seen = [&](Corrections corrections) {
            return apparent_place(kernels, c.target, c.observer, c.time, corrections).position_m;
        };
        CHECK(angle(seen({.light_time = true}), c.astrometric) < 0.01 * mas);
        CHECK(angle(seen({.light_time = true, .aberration = true}), c.aberrated) < 0.01 * mas);
        CHECK(angle(seen({.light_time = true, .aberration = true, .sun_deflection = true}), c.apparent) <
              0.1 * mas);
    }
}

TEST_CASE("Light that grazes the Sun is bent by 1.75 arc seconds") {
    const double au_m = 149597870700.0, radius_m = 695.7e6;
    // From infinity, as in Einstein (1916); towards larger angles.
    const Vec3 sun{0, 0, au_m};
    const Vec3 star = Vec3{radius_m, 0, au_m} * 1e9;
    const Vec3 bent = deflected_by_sun(star, sun);
    CHECK(std::abs(angle(bent, star) / (1000 * mas) - 1.75) < 0.01);
    CHECK(bent.x / bent.z > star.x / star.z);
    // A body at the observer's place, or before the Sun, is hardly moved.
    CHECK(angle(deflected_by_sun({1e9, 0, 1e9}, sun), {1e9, 0, 1e9}) < 0.1 * mas);
}

TEST_CASE("Points below New Horizons and the Sun on Io agree with the header of a LORRI frame") {
    std::vector<std::filesystem::path> files;
    for (const char* name : {"nh_v220.tf", "pck00010.tpc", "lor_0034974380_0x630_sci_1_0.xsp",
                             "lor_0034974380_0x630_sci_1_1.xsp"}) {
        const auto file = test::data_file(std::string("flight_nh_lorri/kernels/") + name);
        if (!file) return;
        files.push_back(*file);
    }
    const Ephemeris kernels(files);
    const int io = kernels.body("IO"), craft = kernels.body("NH_SPACECRAFT"), sun = kernels.body("SUN");
    // SPCSCET, SPCTSCLA, SPCTSCLO, SPCTSOLA, SPCTSOLO, SPCTRANG of the FITS header.
    const TdbTime time{225940527, 0.5162794};
    const Place seen = apparent_place(kernels, io, craft, time, {.light_time = true});
    const Quat to_body = conjugate(kernels.orientation("IAU_IO", seen.seen_at));
    const SurfacePoint below = surface_point(rotate(to_body, -1.0 * seen.position_m));
    CHECK(std::abs(below.latitude_rad / deg - -5.448810533062908) < 0.01);
    CHECK(std::abs(below.longitude_rad / deg - 281.6307164964911) < 0.01);
    // The kernels are cut to seconds: the Sun when the light left it is not in them, but it moves 36 km.
    const Place light = apparent_place(kernels, sun, io, seen.seen_at, {});
    const SurfacePoint subsolar = surface_point(rotate(to_body, light.position_m));
    CHECK(std::abs(subsolar.latitude_rad / deg - -2.940691043777005) < 0.01);
    CHECK(std::abs(subsolar.longitude_rad / deg - 174.2412112480325) < 0.01);
    CHECK(std::abs(length(seen.position_m) / 1000 - 2416533.87342724) < 50);
}

} // namespace places_test
