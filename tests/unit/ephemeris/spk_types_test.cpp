// SPDX-License-Identifier: Apache-2.0
// SPK types of samples, series and orbits against motions in closed form and a step-by-step integration.
#include "core/error.hpp"
#include "ephemeris/kernels/ephemeris.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/daf_writer.hpp"
#include "tests/support/temp_folder.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

namespace spk_types_test {

using namespace obscura;
using namespace obscura::ephemeris;
using Catch::Matchers::ContainsSubstring;
using test::DafSegment;

namespace {

/// Position, km, and velocity, km/s.
using KmState = std::array<double, 6>;
using Motion = std::function<KmState(double)>;
using Words = std::vector<double>;

void append(Words& words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
}

/// A cubic in time, which all polynomial methods of degree 3 or more hold exactly.
KmState cubic(double t) {
    return {7000 + t + 1e-3 * t * t - 1e-6 * t * t * t,
            10 - 2e-3 * t * t,
            5e-6 * t * t * t,
            1 + 2e-3 * t - 3e-6 * t * t,
            -4e-3 * t,
            1.5e-5 * t * t};
}
/// Its acceleration.
std::array<double, 3> cubic_acceleration(double t) {
    return {2e-3 - 6e-6 * t, -4e-3, 3e-5 * t};
}

Ephemeris load(const test::TempFolder& folder, std::int32_t type, double begin, double end, Words words) {
    const DafSegment segment{"TEST", {begin, end}, {-999, 399, 1, type}, std::move(words)};
    return Ephemeris({folder.write("test.bsp", test::daf_bytes("SPK", {segment}, type % 2 == 0))});
}

/// Largest differences, km and km/s, over an interval.
std::array<double, 2> errors(const Ephemeris& kernels, const Motion& motion, double from, double to) {
    std::array<double, 2> worst{};
    for (int i = 0; i <= 500; ++i) {
        const double t = from + (to - from) * i / 500;
        const State s = kernels.state(-999, 399, TdbTime{} + t);
        const KmState truth = motion(t);
        worst[0] = std::max(worst[0], length(s.position_m / 1000 - Vec3{truth[0], truth[1], truth[2]}));
        worst[1] = std::max(worst[1], length(s.velocity_m_s / 1000 - Vec3{truth[3], truth[4], truth[5]}));
    }
    return worst;
}

/// Integrates r'' = -gm r / |r|^3 by Runge and Kutta's method of order 4.
KmState integrated(double gm, KmState s, double dt, int steps) {
    const auto rate = [&](const KmState& y) {
        const double r = std::sqrt(y[0] * y[0] + y[1] * y[1] + y[2] * y[2]);
        const double k = -gm / (r * r * r);
        return KmState{y[3], y[4], y[5], k * y[0], k * y[1], k * y[2]};
    };
    const auto moved = [](const KmState& a, const KmState& b, double h) {
        KmState c;
        for (std::size_t i = 0; i < 6; ++i)
            c[i] = a[i] + h * b[i];
        return c;
    };
    const double h = dt / steps;
    for (int i = 0; i < steps; ++i) {
        const KmState k1 = rate(s), k2 = rate(moved(s, k1, h / 2)), k3 = rate(moved(s, k2, h / 2)),
                      k4 = rate(moved(s, k3, h));
        for (std::size_t j = 0; j < 6; ++j)
            s[j] += h / 6 * (k1[j] + 2 * k2[j] + 2 * k3[j] + k4[j]);
    }
    return s;
}

double distance(const State& a, const KmState& b) {
    return length(a.position_m / 1000 - Vec3{b[0], b[1], b[2]});
}
double difference_of_velocity(const State& a, const KmState& b) {
    return length(a.velocity_m_s / 1000 - Vec3{b[3], b[4], b[5]});
}

/// Packets of types 18 and 19 from `begin` on, every 60 s.
Words packets(int subtype, double begin, int count) {
    Words words;
    for (int i = 0; i < count; ++i) {
        const double t = begin + 60 * i;
        const KmState s = cubic(t);
        const auto a = cubic_acceleration(t);
        words.insert(words.end(), s.begin(), s.begin() + 3);
        if (subtype == 0) {
            words.insert(words.end(), s.begin() + 3, s.end());
            words.insert(words.end(), s.begin() + 3, s.end());
            words.insert(words.end(), a.begin(), a.end());
        } else {
            words.insert(words.end(), s.begin() + 3, s.end());
        }
    }
    for (int i = 0; i < count; ++i)
        words.push_back(begin + 60 * i);
    for (int i = 99; i < count - 1; i += 100)
        words.push_back(begin + 60 * i);
    return words;
}

constexpr double gm = 398600.4418;

} // namespace

TEST_CASE("SPK types 8 and 12 hold states at equal steps") {
    const test::TempFolder folder;
    for (const int type : {8, 12})
        for (const int window : {2, 4, 5, 7}) {
            if (type == 8 && window < 4) continue; // not exact
            Words words;
            for (int i = 0; i <= 10; ++i)
                for (const double v : cubic(60.0 * i))
                    words.push_back(v);
            append(words, {0, 60, window - 1.0, 11});
            const auto worst = errors(load(folder, type, 0, 600, words), cubic, 0, 600);
            CAPTURE(type, window);
            CHECK(worst[0] < 1e-9);
            CHECK(worst[1] < 1e-9);
        }
}

TEST_CASE("SPK type 18 interpolates packets, with fewer at its ends") {
    const test::TempFolder folder;
    for (const int subtype : {0, 1}) {
        Words words = packets(subtype, 0, 230);
        append(words, {static_cast<double>(subtype), subtype == 0 ? 4.0 : 8.0, 230});
        const Ephemeris kernels = load(folder, 18, 0, 60 * 229, words);
        const auto worst = errors(kernels, cubic, 60 * 4, 60 * 225);
        CAPTURE(subtype);
        CHECK(worst[0] < 1e-6);
        CHECK(worst[1] < 1e-7);
        // In the first step two packets are all that lie around the time for a window of two.
        if (subtype == 0) CHECK(errors(kernels, cubic, 0, 60)[0] < 1e-8);
    }
}

TEST_CASE("A window of SPK type 18 shrinks at the ends of the data") {
    const test::TempFolder folder;
    // Squares of time; a window of 4 in the first step has the packets 0, 1 and 2: exact; in a step of two
    // packets only, the line between them.
    Words words;
    for (int i = 0; i < 2; ++i)
        append(words, {static_cast<double>(i * i), 0, 0, 0, 0, 0});
    append(words, {0, 1, 1, 4, 2});
    CHECK(std::abs(load(folder, 18, 0, 1, words).state(-999, 399, {0, 0.25}).position_m.x - 250) < 1e-9);
}

TEST_CASE("SPK type 19 takes the mini-segment that holds at the time") {
    const test::TempFolder folder;
    for (const double later : {0.0, 1.0}) {
        // Three pieces of different subtypes, which overlap; the second is moved by 1 km.
        Words words;
        Words pointers{1};
        const auto add = [&](int subtype, double window, double begin, int count, double offset) {
            Words own = packets(subtype, begin, count);
            const std::size_t size = subtype == 0 ? 12 : 6;
            for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i)
                own[i * size] += offset;
            append(own, {static_cast<double>(subtype), window, static_cast<double>(count)});
            append(words, own);
            pointers.push_back(static_cast<double>(words.size() + 1));
        };
        add(0, 2, 0, 8, 0);
        add(1, 4, 240, 10, 1);
        add(2, 4, 660, 6, 0);
        append(words, {0, 360, 720, 900});
        append(words, pointers);
        append(words, {later, 3});
        const Ephemeris kernels = load(folder, 19, 0, 900, words);
        const auto moved = [](double t) {
            KmState s = cubic(t);
            s[0] += 1;
            return s;
        };
        CHECK(errors(kernels, cubic, 0, 359)[0] < 1e-8);
        CHECK(errors(kernels, moved, 361, 719)[0] < 1e-8);
        CHECK(errors(kernels, cubic, 721, 900)[0] < 1e-8);
        CHECK(errors(kernels, cubic, 721, 900)[1] < 1e-8);
        const double x = kernels.state(-999, 399, {360, 0}).position_m.x / 1000;
        CHECK(std::abs(x - cubic(360)[0] - later) < 1e-8);
    }
}

TEST_CASE("SPK types 14 and 20 are Chebyshev series of unequal steps and of velocities") {
    const test::TempFolder folder;
    // x = u, u = (t - middle) / radius: T_1; its series of velocity is 1 / radius. A parabola in y:
    // u^2 = (T_0 + T_2) / 2, whose velocity is 2 u / radius.
    const auto truth = [](double middle, double radius, double t) {
        const double u = (t - middle) / radius;
        return KmState{u, u * u, 4, 1 / radius, 2 * u / radius, 0};
    };
    Words words{2}; // constant: the degree
    const std::array<std::array<double, 2>, 2> records{{{100, 100}, {250, 50}}};
    for (const auto& [middle, radius] : records)
        append(words,
               {middle, radius, 0, 1, 0, 0.5, 0, 0.5, 4, 0, 0, 1 / radius, 0, 0, 0, 2 / radius, 0, 0, 0, 0});
    append(words, {0, 200});
    // Meta data: constants at 0, packets of 20 at 1, references at 41.
    append(words, {0, 1, 43, 0, 3, 41, 2, 43, 0, 0, 1, 2, 43, 0, 20, 0, 17});
    const Ephemeris unequal = load(folder, 14, 0, 300, words);
    CHECK(errors(
              unequal, [&](double t) { return truth(100, 100, t); }, 0, 199.9)[0] < 1e-12);
    const auto second = errors(
        unequal, [&](double t) { return truth(250, 50, t); }, 200, 300);
    CHECK(second[0] < 1e-12);
    CHECK(second[1] < 1e-12);

    // Records of a quarter of a day, units of 10 km and 100 s, positions in the middle.
    Words velocity;
    constexpr double radius = 86400.0 / 8;
    for (int i = 0; i < 3; ++i)
        append(velocity, {100 / radius / 10, 0, 0, 0, /**/ 0, 200 / radius / 10, 0, 0, /**/ 0, 0, 0, 0.4});
    append(velocity, {10, 100, 2451545, 0.5, 0.25, 12, 3});
    const Ephemeris integrated = load(folder, 20, 43200, 43200 + 3 * 21600, velocity);
    for (int i = 0; i < 3; ++i) {
        const double start = 43200 + 21600.0 * i;
        // y is the integral from the middle, where it is 0.
        const auto worst = errors(
            integrated, [&](double t) { return truth(start + radius, radius, t); }, start, start + 21599);
        CHECK(worst[0] < 1e-10);
        CHECK(worst[1] < 1e-12);
    }
}

TEST_CASE("SPK type 5 follows the two-body motion of its states") {
    const test::TempFolder folder;
    // Ellipse, parabola's neighbourhood and hyperbola.
    for (const double speed : {7.2, 10.685, 14.0}) {
        const KmState start{7000, 100, -300, 0.3, speed, 1.1};
        Words words(start.begin(), start.end());
        append(words, {0, gm, 1});
        const Ephemeris kernels = load(folder, 5, -20000, 20000, words);
        for (const double t : {-9000.0, -500.0, 0.0, 60.0, 4000.0, 15000.0}) {
            const KmState truth = integrated(gm, start, t, 60000);
            const State s = kernels.state(-999, 399, TdbTime{} + t);
            CAPTURE(speed, t);
            CHECK(distance(s, truth) < 1e-4);
            CHECK(difference_of_velocity(s, truth) < 1e-7);
        }
    }
    // Between two states the one turns into the other: half of each in the middle, with the rate of the
    // weight.
    const KmState a{8000, 0, 0, 0, 7, 0}, b{8000, 200, 0, 0, 7, 0};
    Words words(a.begin(), a.end());
    append(words, Words(b.begin(), b.end()));
    append(words, {0, 40, gm, 2});
    const State s = load(folder, 5, 0, 40, words).state(-999, 399, {20, 0});
    const KmState from_a = integrated(gm, a, 20, 1000), from_b = integrated(gm, b, -20, 1000);
    CHECK(std::abs(s.position_m.y / 1000 - (from_a[1] + from_b[1]) / 2) < 1e-8);
    const double weight_rate = -0.5 * std::numbers::pi / 40;
    CHECK(std::abs(s.velocity_m_s.y / 1000 -
                   ((from_a[4] + from_b[4]) / 2 + weight_rate * (from_a[1] - from_b[1]))) < 1e-8);
}

TEST_CASE("SPK type 15 is a conic whose node and periapsis precess") {
    const test::TempFolder folder;
    constexpr double p = 8000, e = 0.1, radius = 6378.137, j2 = 1.0826e-3;
    // Inclination 60 degrees, node on +x, periapsis at the node.
    const double i = std::numbers::pi / 3;
    const auto conic = [&](double flag, double oblateness) {
        return Words{0, 0, -std::sin(i), std::cos(i), 1, 0, 0, p, e, flag, 0, 0, 1, gm, oblateness, radius};
    };
    const double perigee = p / (1 + e), speed = std::sqrt(gm / p) * (1 + e);
    const KmState start{perigee, 0, 0, 0, speed * std::cos(i), speed * std::sin(i)};
    for (const double t : {-3000.0, 1000.0, 6000.0}) {
        const KmState truth = integrated(gm, start, t, 20000);
        CHECK(distance(load(folder, 15, -1e6, 1e6, conic(3, j2)).state(-999, 399, TdbTime{} + t), truth) <
              1e-5);
        CHECK(distance(load(folder, 15, -1e6, 1e6, conic(0, 0)).state(-999, 399, TdbTime{} + t), truth) <
              1e-5);
    }
    // After ten revolutions: the node by -3 pi J2 (R/p)^2 cos i each, the periapsis by
    // 3 pi / 2 J2 (R/p)^2 (5 cos^2 i - 1).
    const double a = p / (1 - e * e);
    const double period = 2 * std::numbers::pi * std::sqrt(a * a * a / gm);
    const double scale = 3 * std::numbers::pi * j2 * (radius / p) * (radius / p) * 10;
    const double node = -scale * std::cos(i), apsis = scale / 2 * (5 * std::cos(i) * std::cos(i) - 1);
    const Vec3 at =
        load(folder, 15, -1e6, 1e6, conic(0, j2)).state(-999, 399, TdbTime{} + 10 * period).position_m / 1000;
    const Vec3 in_plane{perigee * std::cos(apsis), perigee * std::sin(apsis) * std::cos(i),
                        perigee * std::sin(apsis) * std::sin(i)};
    const Vec3 turned{in_plane.x * std::cos(node) - in_plane.y * std::sin(node),
                      in_plane.x * std::sin(node) + in_plane.y * std::cos(node), in_plane.z};
    CHECK(length(at - turned) < 1e-3);
    const Vec3 only_node =
        load(folder, 15, -1e6, 1e6, conic(1, j2)).state(-999, 399, TdbTime{} + 10 * period).position_m / 1000;
    CHECK(length(only_node - perigee * Vec3{std::cos(node), std::sin(node), 0}) < 1e-3);
}

TEST_CASE("SPK type 17 is an orbit of equinoctial elements") {
    const test::TempFolder folder;
    constexpr double a = 20000, e = 0.3, inclination = 0.4, node = 1.1, periapsis = 0.7, mean0 = 0.2;
    const double rate = std::sqrt(gm / (a * a * a));
    const auto elements = [&](double apsis_rate, double node_rate) {
        // The pole of the reference plane is +z, its node +x: right ascension -90, declination 90 degrees.
        return Words{0,
                     a,
                     e * std::sin(periapsis + node),
                     e * std::cos(periapsis + node),
                     mean0 + periapsis + node,
                     std::tan(inclination / 2) * std::sin(node),
                     std::tan(inclination / 2) * std::cos(node),
                     apsis_rate + node_rate,
                     rate + apsis_rate + node_rate,
                     node_rate,
                     -std::numbers::pi / 2,
                     std::numbers::pi / 2};
    };
    // Classical elements to a state, by Kepler's equation and three rotations.
    const auto classical = [&](double t, double apsis_rate, double node_rate) {
        const double mean = mean0 + rate * t;
        double eccentric = mean;
        for (int k = 0; k < 100; ++k)
            eccentric = mean + e * std::sin(eccentric);
        const double x = a * (std::cos(eccentric) - e);
        const double y = a * std::sqrt(1 - e * e) * std::sin(eccentric);
        const double w = periapsis + apsis_rate * t, o = node + node_rate * t;
        const double u = x * std::cos(w) - y * std::sin(w), v = x * std::sin(w) + y * std::cos(w);
        const double vi = v * std::cos(inclination);
        return Vec3{u * std::cos(o) - vi * std::sin(o), u * std::sin(o) + vi * std::cos(o),
                    v * std::sin(inclination)};
    };
    for (const double precession : {0.0, 2e-6}) {
        const Ephemeris kernels = load(folder, 17, -1e6, 1e6, elements(precession, -precession / 2));
        for (const double t : {-30000.0, 0.0, 5000.0, 90000.0}) {
            const State s = kernels.state(-999, 399, TdbTime{} + t);
            CAPTURE(precession, t);
            CHECK(length(s.position_m / 1000 - classical(t, precession, -precession / 2)) < 1e-7);
            const Vec3 difference = classical(t + 0.5, precession, -precession / 2) -
                                    classical(t - 0.5, precession, -precession / 2);
            CHECK(length(s.velocity_m_s / 1000 - difference) < 1e-6);
        }
    }
}

TEST_CASE("A segment that cannot be used is refused when it is asked for, not its file") {
    const test::TempFolder folder;
    Words good;
    for (int i = 0; i <= 10; ++i)
        for (const double v : cubic(60.0 * i))
            good.push_back(v);
    append(good, {0, 60, 3, 11});
    const DafSegment usable{"GOOD", {0, 600}, {-999, 399, 1, 8}, good};
    const DafSegment elements{"TLE", {0, 600}, {-998, 399, 1, 11}, {1, 2, 3}};
    const DafSegment odd_frame{"ODD", {0, 600}, {-997, 399, -77123, 8}, good};
    DafSegment damaged = usable;
    damaged.name = "DAMAGED";
    damaged.integers[0] = -996;
    damaged.words.back() = 12;
    const Ephemeris kernels(
        {folder.write("mixed.bsp", test::daf_bytes("SPK", {usable, elements, odd_frame, damaged}, false))});
    CHECK(std::abs(kernels.state(-999, 399, {60, 0}).position_m.x / 1000 - cubic(60)[0]) < 1e-9);
    CHECK_THROWS_WITH(kernels.state(-998, 399, {60, 0}),
                      ContainsSubstring("mixed.bsp: segment 2 (TLE): SPK type 11 is not supported"));
    CHECK_THROWS_WITH(kernels.state(-997, 399, {60, 0}),
                      ContainsSubstring("segment 3 (ODD): refers to frame -77123, which no kernel defines"));
    CHECK_THROWS_WITH(kernels.state(-996, 399, {60, 0}),
                      ContainsSubstring("segment 4 (DAMAGED): 12 states do not fit"));
    CHECK(kernels.unusable().size() == 3);
    CHECK(kernels.coverage(-998, 399).empty());
}

} // namespace spk_types_test
