// SPDX-License-Identifier: Apache-2.0
// CK types 1 to 6 made by the test, against a turn at a constant rate.
#include "ephemeris/kernels/ephemeris.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/clock_kernel.hpp"
#include "tests/support/daf_writer.hpp"
#include "tests/support/temp_folder.hpp"

#include <array>
#include <cmath>
#include <string_view>
#include <vector>

namespace ck_types_test {

using namespace obscura;
using namespace obscura::ephemeris;
using Catch::Matchers::ContainsSubstring;

namespace {

using Words = std::vector<double>;

constexpr double rate = 0.01; ///< rad/s, about an axis that is none of the base frame's
constexpr double ticks_per_s = 100;
const Vec3 axis = normalized(Vec3{1, -2, 2});

/// Clock of 100 ticks a second from J2000.
constexpr std::string_view steady_clock = "0 0. 1.";

/// Rotation of the instrument's axes at `t`.
Quat turn(double t) {
    return axis_angle(axis, rate * t);
}
/// Quaternion of the file: base frame to instrument; `flip`: its negative, which is the same attitude.
std::array<double, 4> attitude(double t, bool flip = false) {
    const Quat q = conjugate(turn(t));
    const double s = flip ? -1 : 1;
    return {s * q.w, s * q.x, s * q.y, s * q.z};
}
/// Its derivative by seconds.
std::array<double, 4> attitude_rate(double t, bool flip = false) {
    const double half = rate / 2, s = flip ? -1 : 1;
    const double c = s * half * std::cos(half * t), n = -s * half * std::sin(half * t);
    return {n, -c * axis.x, -c * axis.y, -c * axis.z};
}

void append(Words& words, const auto& more) {
    words.insert(words.end(), more.begin(), more.end());
}

Ephemeris load(const test::TempFolder& folder, std::int32_t type, double begin_s, double end_s, Words words,
               std::int32_t rates = 0) {
    const test::DafSegment segment{
        "ATTITUDE", {begin_s * ticks_per_s, end_s * ticks_per_s}, {-77001, 1, type, rates}, std::move(words)};
    return Ephemeris({folder.write("clock.tsc", test::clock_kernel(steady_clock)),
                      folder.write("a.bc", test::daf_bytes("CK", {segment}, type % 2 == 0))});
}

/// Angle between the kernels' attitude and turn(), rad.
double error(const Ephemeris& kernels, double t) {
    const Quat q = kernels.orientation("CRAFT", TdbTime{} + t);
    const Quat d = conjugate(turn(t)) * q;
    return 2 * std::atan2(length(Vec3{d.x, d.y, d.z}), std::abs(d.w));
}

bool covered(const Ephemeris& kernels, double t) {
    Quat q;
    return kernels.frame("CRAFT")->orientation(TdbTime{} + t, q) == Evaluation::ok;
}

/// Packets of a subtype of types 5 and 6, at `times`.
Words packets(int subtype, const std::vector<double>& times) {
    Words words;
    bool flip = false;
    for (const double t : times) {
        append(words, attitude(t, flip));
        if (subtype == 0 || subtype == 2) append(words, attitude_rate(t, flip));
        if (subtype >= 2) append(words, Words{rate * axis.x, rate * axis.y, rate * axis.z});
        if (subtype == 2) append(words, Words{0, 0, 0});
        flip = !flip;
    }
    for (const double t : times)
        words.push_back(t * ticks_per_s);
    for (std::size_t i = 99; i + 1 < times.size(); i += 100)
        words.push_back(times[i] * ticks_per_s);
    return words;
}

std::vector<double> times_from(double begin, int count, double step) {
    std::vector<double> times;
    for (int i = 0; i < count; ++i)
        times.push_back(begin + step * i);
    return times;
}

} // namespace

TEST_CASE("CK type 1 holds at its instants only") {
    const test::TempFolder folder;
    Words words;
    for (const double t : {10.0, 20.0, 50.0}) {
        append(words, attitude(t));
        append(words, Words{0, 0, rate});
    }
    append(words, Words{1000, 2000, 5000, 3});
    const Ephemeris kernels = load(folder, 1, 10, 50, words, 1);
    for (const double t : {10.0, 20.0, 50.0})
        CHECK(error(kernels, t) < 1e-12);
    CHECK(covered(kernels, 20.004));
    CHECK_FALSE(covered(kernels, 20.1));
    CHECK_FALSE(covered(kernels, 30));
}

TEST_CASE("CK type 2 turns at a constant rate within its intervals") {
    const test::TempFolder folder;
    Words words;
    for (const double t : {0.0, 100.0}) {
        append(words, attitude(t));
        append(words, Words{rate * axis.x, rate * axis.y, rate * axis.z, 1 / ticks_per_s});
    }
    append(words, Words{0, 10000, 5000, 20000});
    const Ephemeris kernels = load(folder, 2, 0, 200, words);
    for (const double t : {0.0, 25.0, 50.0, 100.0, 133.3, 200.0})
        CHECK(error(kernels, t) < 1e-12);
    CHECK_FALSE(covered(kernels, 75));
    CHECK_FALSE(covered(kernels, 201));
}

TEST_CASE("CK type 4 is Chebyshev series of the quaternion") {
    const test::TempFolder folder;
    // Series of cosine and sine by their values at the nodes.
    const auto series = [](double middle, double radius, std::size_t component, std::size_t n) {
        Words c(n);
        for (std::size_t k = 0; k < n; ++k) {
            for (std::size_t j = 0; j < n; ++j) {
                const double angle =
                    std::numbers::pi * (static_cast<double>(j) + 0.5) / static_cast<double>(n);
                c[k] += attitude(middle + radius * std::cos(angle))[component] *
                        std::cos(static_cast<double>(k) * angle) * (k == 0 ? 1.0 : 2.0) /
                        static_cast<double>(n);
            }
        }
        return c;
    };
    Words words;
    Words starts{1};
    // Numbers of coefficients: 9, 10, 11, 12, and 1 of each rate; digits to the base 128, the first the
    // lowest.
    const double packed = 9 + 128 * (10 + 128 * (11 + 128 * (12 + 128 * (1 + 128 * (1 + 128.0 * 1)))));
    for (const auto& [middle, radius] : {std::pair{50.0, 50.0}, std::pair{180.0, 60.0}}) {
        append(words, Words{middle * ticks_per_s, radius * ticks_per_s, packed});
        for (std::size_t k = 0; k < 4; ++k)
            append(words, series(middle, radius, k, 9 + k));
        append(words, Words{0, 0, rate});
        starts.push_back(static_cast<double>(words.size() + 1));
    }
    const auto size = static_cast<double>(words.size());
    append(words, Words{0, 120 * ticks_per_s});
    append(words, starts);
    // Meta data: no constants, references behind the packets, then the directory of packets of variable size.
    append(words, Words{0, 0, size + 5, 0, 3, size, 2, size + 2, 3, 1, 0, 2, size + 5, 0, 48, 0, 17});
    const Ephemeris kernels = load(folder, 4, 0, 240, words, 1);
    for (const double t : {0.0, 31.0, 99.0, 121.0, 200.0, 239.0})
        CHECK(error(kernels, t) < 1e-9);
    CHECK_FALSE(covered(kernels, 110));
}

TEST_CASE("CK type 5 interpolates packets within intervals") {
    const test::TempFolder folder;
    for (const int subtype : {0, 1, 2, 3}) {
        std::vector<double> times = times_from(0, 120, 10);
        for (const double t : times_from(2000, 20, 10))
            times.push_back(t);
        Words words = packets(subtype, times);
        append(words, Words{0, 200000, 1 / ticks_per_s, static_cast<double>(subtype), 8, 2,
                            static_cast<double>(times.size())});
        const Ephemeris kernels = load(folder, 5, 0, 2190, words);
        CAPTURE(subtype);
        for (const double t : {0.0, 40.0, 43.0, 777.7, 1149.0, 2045.0, 2100.0})
            CHECK(error(kernels, t) < 1e-8);
        // At an end the window is smaller.
        CHECK(error(kernels, 3) < 1e-4);
        CHECK(error(kernels, 2186) < 1e-4);
        CHECK_FALSE(covered(kernels, 1500));
        CHECK(covered(kernels, 1190));
        CHECK_FALSE(covered(kernels, 1190.1));
    }
}

TEST_CASE("CK type 6 has mini-segments of their own subtypes") {
    const test::TempFolder folder;
    Words words, pointers{1};
    const auto add = [&](int subtype, double begin, int count) {
        const auto times = times_from(begin, count, 10);
        append(words, packets(subtype, times));
        append(words, Words{1 / ticks_per_s, static_cast<double>(subtype), 6, static_cast<double>(count)});
        pointers.push_back(static_cast<double>(words.size() + 1));
    };
    add(0, 0, 11);   // to 100 s
    add(1, 80, 21);  // to 280 s
    add(2, 300, 11); // to 400 s
    add(3, 400, 11); // to 500 s, of an interval to 520 s
    append(words, Words{0, 10000, 30000, 40000, 52000});
    append(words, pointers);
    append(words, Words{1, 4});
    const Ephemeris kernels = load(folder, 6, 0, 520, words);
    for (const double t : {0.0, 45.0, 101.0, 150.0, 250.0, 355.0, 452.0})
        CHECK(error(kernels, t) < 1e-7);
    CHECK(covered(kernels, 500));
    CHECK_FALSE(covered(kernels, 290));
    CHECK_FALSE(covered(kernels, 510));
}

TEST_CASE("A CK that covers instants only holds half a tick beside each, in all types") {
    const test::TempFolder folder;
    const std::vector<double> times{10, 20, 50};
    const double packed = 1 + 128 * (1 + 128 * (1 + 128 * (1 + 128 * (1 + 128 * (1 + 128.0 * 1)))));
    for (std::int32_t type = 1; type <= 6; ++type)
        for (const std::size_t count : {std::size_t{1}, times.size()}) {
            // Mini-segments follow each other without a gap.
            if (type == 6 && count > 1) continue;
            CAPTURE(type, count);
            Words words, at, starts{1};
            for (std::size_t i = 0; i < count; ++i) {
                const double ticks = times[i] * ticks_per_s;
                if (type == 4) append(words, Words{ticks, 0, packed});
                append(words, attitude(times[i]));
                if (type == 2) append(words, Words{0, 0, rate, 1 / ticks_per_s});
                if (type == 4) append(words, Words{0, 0, rate});
                at.push_back(ticks);
                starts.push_back(static_cast<double>(words.size() + 1));
            }
            const auto n = static_cast<double>(count), size = static_cast<double>(words.size());
            append(words, at);
            switch (type) {
            case 1:
                append(words, Words{n});
                break;
            case 2:
                append(words, at);
                break;
            case 3:
                append(words, at);
                append(words, Words{n, n});
                break;
            case 4:
                append(words, starts);
                append(words, Words{0, 0, size + n + 3, 0, 3, size, n, size + n, n + 1, 1, 0, n, size + n + 3,
                                    0, 10, 0, 17});
                break;
            case 5:
                append(words, at);
                append(words, Words{1 / ticks_per_s, 1, 2, n, n});
                break;
            default:
                append(words, Words{1 / ticks_per_s, 1, 2, n});
                append(words, Words{at[0], at[0] + 500, 1, size + 6, 1, 1});
            }
            const Ephemeris kernels = load(folder, type, 10, times[count - 1], words);
            const std::vector<Interval> known = kernels.orientation_coverage("CRAFT");
            REQUIRE(known.size() == count);
            for (std::size_t i = 0; i < count; ++i) {
                for (const double beside_s : {-0.004, 0.0, 0.004})
                    CHECK(error(kernels, times[i] + beside_s) < 1e-4);
                CHECK_FALSE(covered(kernels, times[i] - 0.006));
                CHECK_FALSE(covered(kernels, times[i] + 0.006));
                CHECK(std::abs(known[i].begin_s - times[i]) < 1e-6);
                CHECK(known[i].end_s == known[i].begin_s);
            }
        }
}

TEST_CASE("A CK segment that cannot be used is refused at its times only") {
    const test::TempFolder folder;
    Words words;
    append(words, attitude(0));
    append(words, attitude(0));
    append(words, Words{0, 10000, 0, 1, 2});
    const test::DafSegment good{"GOOD", {0, 10000}, {-77001, 1, 3, 0}, words};
    const test::DafSegment odd{"ODD", {20000, 30000}, {-77001, 1, 9, 0}, words};
    const Ephemeris kernels({folder.write("clock.tsc", test::clock_kernel(steady_clock)),
                             folder.write("a.bc", test::daf_bytes("CK", {good, odd}, false))});
    CHECK(covered(kernels, 50));
    CHECK_THROWS_WITH(kernels.orientation("CRAFT", {250, 0}),
                      ContainsSubstring("a.bc: segment 2 (ODD): CK type 9 is not supported, allowed 1 to 6"));
    CHECK(kernels.unusable().size() == 1);
}

} // namespace ck_types_test
