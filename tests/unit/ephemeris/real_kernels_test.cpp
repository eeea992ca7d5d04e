// SPDX-License-Identifier: Apache-2.0
// States and rotations from real kernels against python3-jplephem, numpy and python3-skyfield.
#include "core/error.hpp"
#include "ephemeris/kernels/ephemeris.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/data.hpp"
#include "tests/support/de405_states.hpp"

#include <array>
#include <cmath>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace real_kernels_test {

using namespace obscura;
using namespace obscura::ephemeris;
using Catch::Matchers::ContainsSubstring;

namespace {

/// Largest angle between the axes of two orientations.
double angle_between(Quat a, Quat b) {
    const Quat d = conjugate(a) * b;
    return 2 * std::atan2(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w));
}

struct Rotation {
    std::string_view frame;
    TdbTime time;
    Mat3 to_icrf;
};

void check_rotations(const Ephemeris& kernels, std::span<const Rotation> cases) {
    for (const Rotation& c : cases) {
        CAPTURE(c.frame, c.time.whole_s);
        CHECK(angle_between(kernels.orientation(c.frame, c.time), from_matrix(c.to_icrf)) < 1e-10);
    }
}

} // namespace

TEST_CASE("States of Sun, planets and Moon agree with python3-jplephem to a millimetre") {
    const auto file = test::data_file("ephemeris/de405_2000-2050.bsp");
    if (!file) return;
    const Ephemeris kernels({*file});
    for (const test::De405State& c : test::de405_states) {
        CAPTURE(c.target, c.observer);
        const State s = kernels.state(c.target, c.observer, c.time);
        // Beyond Saturn a millimetre is less than two steps of a double of kilometres.
        const double limit_m = length(c.position_m) < 2e12 ? 1e-3 : 3e-3;
        CHECK(length(s.position_m - c.position_m) < limit_m);
        CHECK(length(s.velocity_m_s - c.velocity_m_s) < 1e-8);
    }
    CHECK_THROWS_WITH(
        kernels.state(5, 0, {2e9, 0}),
        ContainsSubstring("JUPITER BARYCENTER (5) is covered 1999-12-24T00:00:00.000 TDB to 2050-01-02"));
}

TEST_CASE("IAU rotation models of a text PCK agree with an independent computation to 1e-10 rad") {
    const auto file = test::data_file("ephemeris/pck00010.tpc");
    if (!file) return;
    const Ephemeris kernels({*file});
    // numpy 1.24 in long doubles, from the formulas of Archinal et al. (2011), Celest. Mech. Dyn. Astron.
    // 109, 101.
    const std::array cases{
        Rotation{"IAU_EARTH",
                 {225979232, 0.68539128449999998},
                 {{{-0.92806971473011646, -0.37240585385980784, 0.00069614058023192797},
                   {0.37240594373559238, -0.9280699397513591, -5.5769532441837324e-07},
                   {0.00064627483535780546, 0.00025872930961327482, 0.99999975769396143}}}},
        Rotation{"IAU_MOON",
                 {765958887, 0.35999999999999999},
                 {{{-0.86385056232622115, 0.50370372831800436, -0.0066902950020081139},
                   {-0.46501805178637851, -0.80247089975522423, -0.37389659875270592},
                   {-0.19370187784704809, -0.31987967913667642, 0.9274462644239525}}}},
        Rotation{"IAU_MARS",
                 {-378263968, 0.25},
                 {{{-0.3553706335707506, -0.82136514553921358, 0.44617374473277788},
                   {0.73747952578248865, -0.53965818233003593, -0.40607018518462745},
                   {0.57431320883918324, 0.18473858269887306, 0.79751864819278828}}}},
        Rotation{"IAU_IO",
                 {225979232, 0.5},
                 {{{0.96145926967529505, 0.27452802685395333, -0.015180093119749534},
                   {-0.25412804790100907, 0.86622594695863564, -0.43019942362308866},
                   {-0.10495240838337917, 0.417476911082865, 0.90260623789515093}}}},
        Rotation{"IAU_EUROPA",
                 {1753272032, 0.125},
                 {{{-0.77578415275567081, -0.630610698271028, -0.022115504952237599},
                   {0.57784081558135547, -0.69591269931498778, -0.42638656965293936},
                   {0.25349347167420277, -0.34356318510319683, 0.90427064403324864}}}},
        Rotation{"IAU_JUPITER",
                 {753272032, 0.75},
                 {{{-0.2949921184538008, -0.95538827848250207, -0.014590660998761966},
                   {0.86433236731395213, -0.26030532985291271, -0.43031464542079695},
                   {0.40731954147032845, -0.13955060941611222, 0.9025610331429077}}}},
        Rotation{"IAU_PHOBOS",
                 {853272032, 0.5},
                 {{{-0.47224492409799157, 0.7674732185429689, 0.43355459919481776},
                   {-0.86450859779528777, -0.30724515169805888, -0.39777544053908437},
                   {-0.1720744490088755, -0.56265911134303492, 0.80858215935114375}}}},
        Rotation{"IAU_NEPTUNE",
                 {653272032, 0.5},
                 {{{0.54507976023351812, 0.75715196048984579, 0.36001244938217553},
                   {-0.44911538813075891, 0.62630447533085987, -0.63721116776520348},
                   {-0.70794309314232928, 0.18564377960739628, 0.6814344898558865}}}},
        Rotation{"IAU_SUN",
                 {553272032, 0.0625},
                 {{{-0.85849582402933367, 0.49801058498722017, 0.1223534934723278},
                   {-0.49902249059476739, -0.75629793462539441, -0.42307208364764326},
                   {-0.11815868146180177, -0.42426276212042213, 0.89779710106079003}}}},
        Rotation{"IAU_TITAN",
                 {453272032, 0.5},
                 {{{0.75947872730415522, 0.64450650013167921, 0.088337048062939072},
                   {-0.65022766886526706, 0.75624587801102372, 0.072774656532175283},
                   {-0.019900789293422025, -0.11270999635945744, 0.99342861610995958}}}},
    };
    check_rotations(kernels, cases);
    const auto io = kernels.radii_m(501);
    REQUIRE(io);
    CHECK(length(*io - Vec3{1829.4, 1819.4, 1815.7} * 1000.0) < 1e-6);
    CHECK_FALSE(kernels.radii_m(-98));
}

TEST_CASE("Principal and mean axes of the Moon from a binary PCK agree with python3-skyfield to 1e-10 rad") {
    const auto file = test::data_file("ephemeris/moon_pa_de421_1900-2050.bpc");
    if (!file) return;
    const Ephemeris kernels({*file});
    // skyfield 1.45: PlanetaryConstants, build_frame_named(NAME).rotation_at(ts.tdb_jd(...)), transposed.
    const std::array cases{
        Rotation{"MOON_PA_DE421",
                 {765958887, 0.35999999999999999},
                 {{{-0.86368350850803122, 0.50398587696920771, -0.0070023529500121027},
                   {-0.46514161289058908, -0.80231333038422625, -0.37408100706305986},
                   {-0.19414962551805054, -0.31983051090124315, 0.92736959579654665}}}},
        Rotation{"MOON_PA_DE421",
                 {-378263968, 0.25},
                 {{{0.66286098577732144, 0.74874101355192735, 0.0014859877356105632},
                   {-0.69441178639688383, 0.61550307271424087, -0.37275761346002911},
                   {-0.28001354332854367, 0.24605459171606742, 0.92792755829753915}}}},
        Rotation{"MOON_ME_DE421",
                 {765958887, 0.35999999999999999},
                 {{{-0.86385202122608495, 0.50370146094180757, -0.0066726058400507111},
                   {-0.46501983994272156, -0.80246590742876178, -0.37390508939325734},
                   {-0.19369107848131156, -0.31989577311934392, 0.92744296884343436}}}},
        Rotation{"MOON_ME_DE421",
                 {-378263968, 0.25},
                 {{{0.66261491822950125, 0.74895924163983474, 0.0012347072509159875},
                   {-0.69475634662283092, 0.6152749214186054, -0.37249213401174747},
                   {-0.27974111061302426, 0.24596102422053126, 0.92803452823554933}}}},
    };
    check_rotations(kernels, cases);
    CHECK_THROWS_WITH(kernels.orientation("MOON_PA_DE421", {2e9, 0}),
                      ContainsSubstring("MOON_PA_DE421 is covered 1900-"));
    // The IAU model of the Moon is of mean Earth axes.
    const auto text = test::data_file("ephemeris/pck00010.tpc");
    if (!text) return;
    const Ephemeris both({*file, *text});
    CHECK(angle_between(both.orientation("IAU_MOON", {0, 0}), both.orientation("MOON_ME_DE421", {0, 0})) <
          1e-4);
}

TEST_CASE("Attitude and states of New Horizons from its kernels agree with the header of a LORRI frame") {
    std::vector<std::filesystem::path> files;
    for (const char* name :
         {"naif0012.tls", "new_horizons_1454.tsc", "nh_v220.tf", "pck00010.tpc",
          "lor_0034974380_0x630_sci_1_0.xsp", "lor_0034974380_0x630_sci_1_1.xsp",
          "merged_nhpc_2007_v006_0_sliced_-98000.xc", "merged_nhpc_2007_v006_1_sliced_-98000.xc"}) {
        const auto file = test::data_file(std::string("flight_nh_lorri/kernels/") + name);
        if (!file) return;
        files.push_back(*file);
    }
    const Ephemeris kernels(files);
    // SPCSCET, SPCQA to SPCQZ, SPCTSC?, SPCSSC? of the frame's FITS header. The header was made with an
    // earlier clock kernel (attitude) and earlier orbits (positions), with light time.
    const TdbTime time{225940527, 0.5162794};
    const Quat header{0.3354434782236541, 0.5813652327449823, -0.4374442408743588, -0.5984435438689647};
    CHECK(angle_between(kernels.orientation("NH_LORRI", time), header) < 1e-8);
    const State io = kernels.state(kernels.body("IO"), kernels.body("NH_SPACECRAFT"), time);
    const Vec3 header_io = Vec3{2390853.218209834, -321807.9307576804, 141054.9754471573} * 1000.0;
    CHECK(length(io.position_m - header_io) < 250e3);
    const State sun = kernels.state(kernels.body("SUN"), kernels.body("-98"), time);
    const Vec3 header_sun = Vec3{313438160.4955826, 679657777.1692598, 284005394.9882899} * 1000.0;
    CHECK(length(sun.position_m - header_sun) < 50e3);
    // Times between the two exposures are a gap.
    CHECK(kernels.coverage(501).size() == 2);
    CHECK_THROWS_WITH(kernels.orientation("NH_LORRI", {225940000, 0}),
                      ContainsSubstring("NH_SPACECRAFT is covered 2007-02-28T12:30:54.626 TDB to"));
}

} // namespace real_kernels_test
