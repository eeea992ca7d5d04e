// SPDX-License-Identifier: Apache-2.0
// Text kernels, meta-kernels, names, frames, spacecraft clocks and attitudes, from kernels made by the test.
#include "core/error.hpp"
#include "ephemeris/kernels/ephemeris.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/clock_kernel.hpp"
#include "tests/support/daf_writer.hpp"
#include "tests/support/temp_folder.hpp"

#include <array>
#include <cmath>
#include <numbers>
#include <string_view>

namespace frames_test {

using namespace obscura;
using namespace obscura::ephemeris;
using Catch::Matchers::ContainsSubstring;

namespace {

constexpr double deg = std::numbers::pi / 180;

double angle_between(Quat a, Quat b) {
    const Quat d = conjugate(a) * b;
    return 2 * std::atan2(std::sqrt(d.x * d.x + d.y * d.y + d.z * d.z), std::abs(d.w));
}

KernelPool pool_of(const std::string& text) {
    KernelPool pool;
    pool.read_text(text, "test.tpc");
    return pool;
}

/// Message of a text kernel that is refused.
std::string refusal(const std::string& data) {
    try {
        (void)pool_of("KPL/PCK\n\\begindata\n" + data + "\n");
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

/// Instrument turned by `angle` about the z axis: a CK's quaternion takes vectors from the base frame's axes
/// to those of the instrument.
std::array<double, 4> about_z(double angle_rad) {
    return {std::cos(angle_rad / 2), 0, 0, -std::sin(angle_rad / 2)};
}

/// CK of instrument -77001 of attitudes about z, degrees, at ticks.
test::DafSegment ck_segment(const std::vector<std::pair<double, double>>& samples,
                            const std::vector<double>& starts, std::int32_t base = 1) {
    std::vector<double> words;
    for (const auto& [ticks, angle] : samples)
        for (const double q : about_z(angle * deg))
            words.push_back(q);
    for (const auto& [ticks, angle] : samples)
        words.push_back(ticks);
    words.insert(words.end(), starts.begin(), starts.end());
    words.insert(words.end(), {static_cast<double>(starts.size()), static_cast<double>(samples.size())});
    return {"ATTITUDE", {samples.front().first, samples.back().first}, {-77001, base, 3, 0}, words};
}

/// Clock of 100 ticks a second that starts at J2000 and is 1 % fast after 1000 s.
constexpr std::string_view changing_clock = "0 0. 1.D0\n 100000 1000. 0.99";

} // namespace

TEST_CASE("Text kernels hold numbers, strings, dates and lists, replaced and appended") {
    const KernelPool pool = pool_of("KPL/PCK\r\nA = 1 is text\r\n  \\begindata\r\n"
                                    "A = 5\tB=-1.5D+3\r\n"
                                    "LIST = ( 1, 2 3\n  4.e0 )\n"
                                    "S = 'it''s'   T = ( 'a' , 'b' )\n"
                                    "D = @1972-JAN-1 D += @2000-JAN-1-12:00 D+=( @1-OCT-2000/06:30:15.5 )\n"
                                    "\\begintext\nA = 7\n\\begindata\nLIST += 5\nT = 'c'\nNAME+= 2\n");
    const auto numbers = [&](const char* name) { return pool.find(name)->numbers; };
    CHECK(numbers("A") == std::vector<double>{5});
    CHECK(numbers("B") == std::vector<double>{-1500});
    CHECK(numbers("LIST") == std::vector<double>{1, 2, 3, 4, 5});
    CHECK(pool.find("S")->strings == std::vector<std::string>{"it's"});
    CHECK(pool.find("T")->strings == std::vector<std::string>{"c"});
    CHECK(numbers("D") == std::vector<double>{-883656000, 0, 23653815.5});
    CHECK(numbers("NAME") == std::vector<double>{2});
    CHECK(pool.find("A")->place == "test.tpc:4: A");
}

TEST_CASE("Mistakes in text kernels are one line with file and line") {
    CHECK(refusal("A = x") == "test.tpc:3: A: 'x' is not a number, a date (@) or a string in quotes");
    CHECK(refusal("A = ( 1 2") == "test.tpc:3: A: list without closing parenthesis");
    CHECK(refusal("\nA 5") == "test.tpc:4: 'A' is not followed by = or +=");
    CHECK(refusal("= 5") == "test.tpc:3: '=' where the name of a variable is expected");
    CHECK(refusal("A = 'x") == "test.tpc:3: string without closing quote");
    CHECK(refusal("A = ( 1 'x' )") == "test.tpc:3: A: numbers and strings in one variable");
    CHECK(refusal("A = ( )") == "test.tpc:3: A: no value");
    CHECK(refusal("A = @2000-FOO-1").starts_with("test.tpc:3: A: '@2000-FOO-1' is not a date"));
    CHECK(refusal("A = 1e999").starts_with("test.tpc:3: A: '1e999' is not a number"));
    CHECK_THROWS_WITH(pool_of("solar system\n"), "test.tpc: no line \\begindata: not a SPICE kernel");
}

TEST_CASE("Meta-kernels load files relative to their folder, with path symbols and continued names") {
    const test::TempFolder folder;
    folder.write("data/a.tpc", "KPL/PCK\n\\begindata\nX = 1 Y = 1\n");
    folder.write("data/b.tpc", "KPL/PCK\n\\begindata\nX = 2\n");
    const auto meta = folder.write("meta.tm", "KPL/MK\n\\begindata\nPATH_SYMBOLS = ( 'K' 'KK' )\n"
                                              "PATH_VALUES = ( 'none' 'data' )\n"
                                              "KERNELS_TO_LOAD = ( '$KK/a+' '.tpc' 'data/b.tpc' )\n");
    const Ephemeris kernels({meta});
    CHECK(kernels.pool().number("X") == 2);
    CHECK(kernels.pool().number("Y") == 1);
    const auto circle = folder.write("circle.tm", "KPL/MK\n\\begindata\nKERNELS_TO_LOAD = ( 'circle.tm' )\n");
    CHECK_THROWS_WITH(Ephemeris({circle}), ContainsSubstring("name each other"));
    const auto missing = folder.write("missing.tm", "KPL/MK\n\\begindata\nKERNELS_TO_LOAD = 'none.bsp'\n");
    CHECK_THROWS_WITH(Ephemeris({missing}),
                      ContainsSubstring("none.bsp: cannot be opened") && ContainsSubstring("missing.tm"));
}

TEST_CASE("Bodies are found by name or code, and kernels add names") {
    const test::TempFolder folder;
    const auto file = folder.write("names.tf", "KPL/FK\n\\begindata\n"
                                               "NAIF_BODY_NAME += ( 'Test Craft' 'EUROPA' )\n"
                                               "NAIF_BODY_CODE += ( -900 -901 )\n");
    const Ephemeris plain({}), kernels({file});
    CHECK(plain.body("europa") == 502);
    CHECK(plain.body("  Earth  Moon   barycenter ") == 3);
    CHECK(plain.body("-98") == -98);
    CHECK(plain.body("NEW_HORIZONS") == -98);
    CHECK(plain.body_name(399) == "EARTH");
    CHECK(plain.body_name(12345) == "12345");
    CHECK(kernels.body("TEST CRAFT") == -900);
    CHECK(kernels.body("EUROPA") == -901);
    CHECK(kernels.body_name(502) == "502");
    CHECK_THROWS_WITH(plain.body("EUROPE"), "body EUROPE: unknown, did you mean \"EUROPA\"?");
    const auto bad =
        folder.write("bad.tf", "KPL/FK\n\\begindata\nNAIF_BODY_NAME = ( 'A' 'B' ) NAIF_BODY_CODE = 1\n");
    const std::vector<std::string> problems = Ephemeris({bad}).unusable();
    REQUIRE(problems.size() == 1);
    CHECK_THAT(problems.front(), ContainsSubstring("bad.tf:3: NAIF_BODY_NAME: 2 names but 1 codes"));
}

TEST_CASE("Galactic and FK4 axes agree with astropy") {
    const Ephemeris kernels({});
    // astropy 5.2.1: Galactic and FK4NoETerms(B1950) to FK5(J2000), which differ from SPICE's definitions in
    // the precession constants.
    const Mat3 galactic{{{-0.05487553939571448, 0.49410945362336345, -0.8676661356858694},
                         {-0.8734371047274334, -0.4448295942988165, -0.1980763896109499},
                         {-0.48383499177032224, 0.7469822487020499, 0.4559837945175692}}};
    const Mat3 fk4{{{9.9992567949569255e-01, -1.1181483218047914e-02, -4.8590038197832419e-03},
                    {1.1181483236753271e-02, 9.9993748489334033e-01, -2.7162594763740806e-05},
                    {4.8590037767386862e-03, -2.7170293732340336e-05, 9.9998819460235266e-01}}};
    CHECK(angle_between(kernels.orientation("GALACTIC", {}), from_matrix(galactic)) < 1e-6);
    CHECK(angle_between(kernels.orientation("FK4", {}), from_matrix(fk4)) < 1e-6);
}

TEST_CASE("Frames with fixed offsets are matrices, angles and quaternions relative to others") {
    const test::TempFolder folder;
    const auto file = folder.write("frames.tf", R"(KPL/FK
\begindata
FRAME_A = 1000001
FRAME_1000001_NAME = 'A'
FRAME_1000001_CLASS = 4
TKFRAME_1000001_RELATIVE = 'J2000'
TKFRAME_1000001_SPEC = 'MATRIX'
TKFRAME_1000001_MATRIX = ( 0 1 0  -1 0 0  0 0 1 )
FRAME_B = 1000002
FRAME_1000002_NAME = 'B'
FRAME_1000002_CLASS = 4
TKFRAME_B_RELATIVE = 'A'
TKFRAME_B_SPEC = 'ANGLES'
TKFRAME_B_ANGLES = ( 0 30 0 )
TKFRAME_B_AXES = ( 3 1 2 )
TKFRAME_B_UNITS = 'DEGREES'
FRAME_C = 1000003
FRAME_1000003_NAME = 'C'
FRAME_1000003_CLASS = 4
TKFRAME_1000003_RELATIVE = 'B'
TKFRAME_1000003_SPEC = 'QUATERNION'
TKFRAME_1000003_Q = ( 0.7071067811865476 0 0 0.7071067811865476 )
FRAME_LOOP = 1000004
FRAME_1000004_CLASS = 4
TKFRAME_1000004_RELATIVE = 'LOOP'
TKFRAME_1000004_SPEC = 'QUATERNION'
TKFRAME_1000004_Q = ( 1 0 0 0 )
FRAME_DYN = 1000005
FRAME_1000005_CLASS = 5
FRAME_SKEW = 1000006
FRAME_1000006_CLASS = 4
TKFRAME_1000006_RELATIVE = 'J2000'
TKFRAME_1000006_SPEC = 'MATRIX'
TKFRAME_1000006_MATRIX = ( 1 1 0  0 1 0  0 0 1 )
)");
    const Ephemeris kernels({file});
    // By columns: the x axis of A is J2000's y axis.
    const Quat a = axis_angle({0, 0, 1}, 90 * deg);
    // Coordinates in A are [30 deg]_1 of those in B: its y axis is at -30 degrees.
    const Quat b = a * axis_angle({1, 0, 0}, -30 * deg);
    const Quat c = b * axis_angle({0, 0, 1}, 90 * deg);
    CHECK(angle_between(kernels.orientation("a", {}), a) < 1e-12);
    CHECK(angle_between(kernels.orientation("B", {}), b) < 1e-12);
    CHECK(angle_between(kernels.orientation("C", {}), c) < 1e-12);
    CHECK_THROWS_WITH(kernels.orientation("LOOP", {}), ContainsSubstring("relative to itself"));
    CHECK_THROWS_WITH(kernels.orientation("DYN", {}),
                      ContainsSubstring("frames.tf:28: FRAME_DYN: frame of class 5 (dynamic), allowed 2"));
    CHECK_THROWS_WITH(kernels.orientation("SKEW", {}), ContainsSubstring("not a rotation matrix"));
    CHECK_THROWS_WITH(kernels.orientation("NONE", {}), ContainsSubstring("frame NONE: unknown"));
    CHECK_THROWS_WITH(kernels.orientation("IAU_MARS", {}), ContainsSubstring("a PCK kernel is needed"));
}

TEST_CASE("Attitudes of a CK are interpolated at the spacecraft's clock, within intervals") {
    const test::TempFolder folder;
    const auto clock = folder.write("clock.tsc", test::clock_kernel(changing_clock));
    for (const bool big : {false, true}) {
        // A gap between 20000 and 40000 ticks.
        const auto ck = folder.write(
            "a.bc",
            test::daf_bytes("CK",
                            {ck_segment({{10000, 0}, {20000, 90}, {40000, 100}, {100000, 160}, {101000, 170}},
                                        {10000, 40000})},
                            big));
        const Ephemeris kernels({clock, ck});
        const auto angle_at = [&](double t) {
            const Vec3 x = rotate(kernels.orientation("CRAFT", TdbTime{} + t), {1, 0, 0});
            return std::atan2(x.y, x.x) / deg;
        };
        CHECK(std::abs(angle_at(100) - 0) < 1e-9);
        CHECK(std::abs(angle_at(150) - 45) < 1e-9);
        CHECK(std::abs(angle_at(500) - 110) < 1e-9);
        // After 1000 s a tick is 0.0099 s.
        CHECK(std::abs(angle_at(1000 + 4.95) - 165) < 1e-9);
        const auto frame = kernels.frame("CRAFT");
        Quat q;
        CHECK(frame->orientation({300, 0}, q) == Evaluation::no_coverage);
        CHECK(frame->orientation({50, 0}, q) == Evaluation::no_coverage);
        CHECK(frame->orientation({-50, 0}, q) == Evaluation::no_coverage);
        CHECK_THROWS_WITH(
            kernels.orientation("CRAFT", {300, 0}),
            ContainsSubstring("CRAFT is covered 2000-01-01T12:01:40.000 TDB to 2000-01-01T12:03:20.000 TDB, "
                              "2000-01-01T12:06:40.000 TDB to 2000-01-01T12:16:49.900 TDB"));
        // A gap of the last file is filled by the one before it.
        const auto before =
            folder.write("b.bc", test::daf_bytes("CK", {ck_segment({{0, -10}, {50000, -10}}, {0})}, big));
        const Ephemeris both({clock, before, ck});
        CHECK(rotate(both.orientation("CRAFT", {300, 0}), {1, 0, 0}).y < -0.17);
        CHECK(rotate(both.orientation("CRAFT", {150, 0}), {1, 0, 0}).y > 0.7);
    }
    const auto ck = folder.write("a.bc", test::daf_bytes("CK", {ck_segment({{0, 0}, {1, 1}}, {0})}, false));
    CHECK_THROWS_WITH(Ephemeris({ck}).frame("-77001"), ContainsSubstring("unknown"));
    auto bad = ck_segment({{0, 0}, {1, 1}}, {0});
    bad.words[0] = 3;
    const auto long_one = folder.write("long.bc", test::daf_bytes("CK", {bad}, false));
    CHECK_THROWS_WITH(Ephemeris({clock, long_one}).frame("CRAFT"),
                      ContainsSubstring("long.bc: segment 1 (ATTITUDE): quaternion 1 of 2 has length"));
    bad = ck_segment({{0, 0}, {1, 1}}, {0});
    bad.integers[2] = 7;
    const auto type7 = folder.write("seven.bc", test::daf_bytes("CK", {bad}, false));
    CHECK_THROWS_WITH(Ephemeris({clock, type7}).frame("CRAFT"),
                      ContainsSubstring("CK type 7 is not supported, allowed 1 to 6"));
}

} // namespace frames_test
