// SPDX-License-Identifier: Apache-2.0
// SPK kernels made by the test, of each supported type and both byte orders, against the motions they hold.
#include "core/error.hpp"
#include "ephemeris/kernels/ephemeris.hpp"
#include "ephemeris/segments/interpolation.hpp"
#include "tests/support/catch.hpp"
#include "tests/support/daf_writer.hpp"
#include "tests/support/temp_folder.hpp"

#include <array>
#include <cmath>
#include <functional>
#include <numbers>

namespace spk_test {

using namespace obscura;
using namespace obscura::ephemeris;
using Catch::Matchers::ContainsSubstring;
using test::DafSegment;

namespace {

/// Position, km, and velocity, km/s, by time.
using Motion = std::function<std::array<double, 6>(double)>;

/// Cubic in time on each axis, which every method represents exactly.
std::array<double, 6> cubic(double t) {
    const double u = t / 1000;
    std::array<double, 6> s{};
    constexpr double c[3][4] = {{7000, 3, -0.25, 0.125}, {-1200, 0.5, 2, -0.0625}, {350, -7, 0.5, 1}};
    for (std::size_t i = 0; i < 3; ++i) {
        s[i] = c[i][0] + u * (c[i][1] + u * (c[i][2] + u * c[i][3]));
        s[i + 3] = (c[i][1] + u * (2 * c[i][2] + u * 3 * c[i][3])) / 1000;
    }
    return s;
}

/// Circular orbit.
std::array<double, 6> circle(double t) {
    constexpr double r = 9000, w = 2 * std::numbers::pi / 8000;
    return {r * std::cos(w * t),      r * std::sin(w * t),     10 * std::cos(w * t),
            -r * w * std::sin(w * t), r * w * std::cos(w * t), -10 * w * std::sin(w * t)};
}

DafSegment segment(std::int32_t type, double begin, double end, std::vector<double> words,
                   std::int32_t target = 1, std::int32_t center = 0) {
    return {"TEST", {begin, end}, {target, center, 1, type}, std::move(words)};
}

/// Chebyshev coefficients of a cubic on [-1, 1] from its values at the four Chebyshev nodes.
std::array<double, 4> chebyshev_of(const std::function<double(double)>& f) {
    std::array<double, 4> c{};
    for (int k = 0; k < 4; ++k) {
        for (int j = 0; j < 4; ++j) {
            const double a = std::numbers::pi * (j + 0.5) / 4;
            c[static_cast<std::size_t>(k)] += f(std::cos(a)) * std::cos(k * a) * (k == 0 ? 0.25 : 0.5);
        }
    }
    return c;
}

/// Types 2 and 3: records of 500 s from `start`.
DafSegment chebyshev_segment(std::int32_t type, double start, int records, const Motion& motion) {
    std::vector<double> words;
    constexpr double length = 500;
    for (int i = 0; i < records; ++i) {
        const double mid = start + length * (i + 0.5);
        words.insert(words.end(), {mid, length / 2});
        for (std::size_t axis = 0; axis < (type == 2 ? 3 : 6); ++axis)
            for (const double c : chebyshev_of([&](double x) { return motion(mid + x * length / 2)[axis]; }))
                words.push_back(c);
    }
    words.insert(words.end(), {start, length, type == 2 ? 14.0 : 26.0, static_cast<double>(records)});
    return segment(type, start, start + length * records, words);
}

/// Types 9 and 13: samples at uneven times; `window` samples are used together.
DafSegment sampled_segment(std::int32_t type, int count, int window, const Motion& motion) {
    std::vector<double> words, times;
    for (int i = 0; i < count; ++i) {
        const double t = 100.0 * i + 20 * std::sin(i);
        times.push_back(t);
        for (const double v : motion(t))
            words.push_back(v);
    }
    words.insert(words.end(), times.begin(), times.end());
    for (int i = 99; i < count - 1; i += 100)
        words.push_back(times[static_cast<std::size_t>(i)]);
    words.insert(words.end(), {window - 1.0, static_cast<double>(count)});
    return segment(type, times.front(), times.back(), words);
}

/// Types 1 and 21: one difference line for each 1000 s. The modified divided differences of order k are those
/// of the acceleration at the reference time and at earlier steps, times products of step sums: for an
/// acceleration that is linear in time, a(t) = a0 + a1 (t - t0), they are a0 and a1 h with the first step h.
DafSegment difference_segment(std::int32_t type, int count, const Motion& motion) {
    const std::size_t n = type == 1 ? 15 : 20;
    std::vector<double> words, times;
    for (int i = 0; i < count; ++i) {
        const double t = 1000.0 * (i + 1);
        times.push_back(t);
        constexpr double h = 50;
        // Second and third derivatives by differences of the velocity: exact for a cubic.
        const auto low = motion(t - h), mid = motion(t), high = motion(t + h);
        std::vector<double> record(4 * n + 11, 0.0);
        record[0] = t;
        for (std::size_t k = 0; k < n; ++k)
            record[1 + k] = h * static_cast<double>(k + 1);
        for (std::size_t axis = 0; axis < 3; ++axis) {
            record[1 + n + 2 * axis] = mid[axis];
            record[2 + n + 2 * axis] = mid[axis + 3];
            const double a0 = (high[axis + 3] - low[axis + 3]) / (2 * h);
            const double a1 = (high[axis + 3] - 2 * mid[axis + 3] + low[axis + 3]) / (h * h);
            record[7 + n + axis * n] = a0;
            record[8 + n + axis * n] = a1 * h;
            record[8 + 4 * n + axis] = 2;
        }
        record[7 + 4 * n] = 3;
        words.insert(words.end(), record.begin(), record.end());
    }
    words.insert(words.end(), times.begin(), times.end());
    for (int i = 99; i < count; i += 100)
        words.push_back(times[static_cast<std::size_t>(i)]);
    if (type == 21) words.push_back(static_cast<double>(n));
    words.push_back(count);
    return segment(type, 0, times.back(), words);
}

/// Largest differences from a motion over the covered interval: m and m/s.
std::array<double, 2> errors(const Ephemeris& kernels, const Motion& motion, double from, double to) {
    std::array<double, 2> worst{};
    for (int i = 0; i <= 997; ++i) {
        const double t = from + (to - from) * i / 997;
        const State s = kernels.state(1, 0, TdbTime{} + t);
        const auto truth = motion(t);
        worst[0] = std::max(worst[0], length(s.position_m - Vec3{truth[0], truth[1], truth[2]} * 1000.0));
        worst[1] = std::max(worst[1], length(s.velocity_m_s - Vec3{truth[3], truth[4], truth[5]} * 1000.0));
    }
    return worst;
}

Ephemeris load(const test::TempFolder& folder, const std::vector<DafSegment>& segments, bool big = false) {
    return Ephemeris({folder.write("test.bsp", test::daf_bytes("SPK", segments, big))});
}

std::string message_of(const std::function<void()>& f) {
    try {
        f();
    } catch (const InputError& error) {
        return error.what();
    }
    return "no error";
}

} // namespace

TEST_CASE("SPK types 2, 3, 9 and 13 represent a cubic in both byte orders") {
    const test::TempFolder folder;
    for (const bool big : {false, true}) {
        for (const std::int32_t type : {2, 3}) {
            const auto worst =
                errors(load(folder, {chebyshev_segment(type, -1000, 5, cubic)}, big), cubic, -1000, 1500);
            CAPTURE(type, big);
            CHECK(worst[0] < 1e-6);
            CHECK(worst[1] < 1e-9);
        }
        for (const std::int32_t type : {9, 13})
            for (const int window : {2, 3, 4, 7, 8}) {
                if (type == 9 && window < 4) continue; // not exact
                const auto worst =
                    errors(load(folder, {sampled_segment(type, 230, window, cubic)}, big), cubic, 0, 22900);
                CAPTURE(type, big, window);
                CHECK(worst[0] < 1e-4);
                CHECK(worst[1] < 1e-7);
            }
    }
}

TEST_CASE("SPK types 1 and 21 represent a cubic in both byte orders") {
    const test::TempFolder folder;
    for (const bool big : {false, true})
        for (const std::int32_t type : {1, 21}) {
            const auto worst =
                errors(load(folder, {difference_segment(type, 130, cubic)}, big), cubic, 0, 130000);
            CAPTURE(type, big);
            // The cubic reaches 2e9 m.
            CHECK(worst[0] < 1e-3);
            CHECK(worst[1] < 1e-6);
        }
}

TEST_CASE("A difference line is the double integral of its acceleration polynomial") {
    // Newton polynomial with nodes at the reference time and g[0], g[1], ... before it.
    constexpr std::size_t n = 20, orders = 9;
    std::array<double, 4 * n + 11> record{};
    record[0] = 1000;
    for (std::size_t k = 0; k < n; ++k)
        record[1 + k] = 40.0 * static_cast<double>(k + 1) + 7 * std::sin(static_cast<double>(k));
    for (std::size_t axis = 0; axis < 3; ++axis) {
        record[1 + n + 2 * axis] = 500.0 + static_cast<double>(axis);
        record[2 + n + 2 * axis] = 0.25 * static_cast<double>(axis) - 0.5;
        for (std::size_t k = 0; k < orders; ++k)
            record[7 + n + axis * n + k] = 1e-3 * std::cos(static_cast<double>(3 * k + axis));
        record[8 + 4 * n + axis] = static_cast<double>(orders - axis);
    }
    record[7 + 4 * n] = orders + 1;
    const double delta = 35;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto acceleration = [&](double s) {
            double sum = 0, basis = 1, node = 0;
            for (std::size_t k = 0; k < orders - axis; ++k) {
                sum += record[7 + n + axis * n + k] * basis;
                basis *= (s + node) / record[1 + k];
                node = record[1 + k];
            }
            return sum;
        };
        // Simpson's rule: the polynomial is smooth.
        constexpr int steps = 2000;
        double velocity = 0, position = 0;
        for (int i = 0; i <= steps; ++i) {
            const double s = delta * i / steps;
            const double weight = (i == 0 || i == steps ? 1.0 : i % 2 == 1 ? 4.0 : 2.0) * delta / steps / 3;
            velocity += weight * acceleration(s);
            position += weight * acceleration(s) * (delta - s);
        }
        ValueAndRate out[3];
        REQUIRE(difference_line(record, n, TdbTime{1035, 0}, out));
        const double p0 = record[1 + n + 2 * axis], v0 = record[2 + n + 2 * axis];
        CHECK(std::abs(out[axis].rate - (v0 + velocity)) < 1e-12);
        CHECK(std::abs(out[axis].value - (p0 + v0 * delta + position)) < 1e-11);
    }
}

TEST_CASE("SPK interpolation follows a circular orbit with the order of its window") {
    const test::TempFolder folder;
    const auto of = [&](std::int32_t type, int window) {
        return errors(load(folder, {sampled_segment(type, 101, window, circle)}), circle, 1000, 9000)[0];
    };
    // Bounds of the interpolation error: f^(n) / n! prod |t - t_i| for the orbit's rate and the steps.
    CHECK(of(9, 4) > 1);
    CHECK(of(9, 4) < 100);
    CHECK(of(9, 8) < 0.05);
    CHECK(of(9, 11) < 1e-4);
    CHECK(of(13, 4) < 0.01);
    CHECK(of(13, 7) < 1e-5);
}

TEST_CASE("The last segment of the last file that covers a time holds") {
    const test::TempFolder folder;
    const auto fixed = [](double x, double begin, double end) {
        return segment(2, begin, end,
                       {(begin + end) / 2, (end - begin) / 2, x, 0, 0, begin, end - begin, 5, 1});
    };
    const auto a = folder.write("a.bsp", test::daf_bytes("SPK", {fixed(1, 0, 100), fixed(2, 50, 60)}, false));
    const auto b = folder.write("b.bsp", test::daf_bytes("SPK", {fixed(3, 55, 80)}, true));
    const auto x = [](const Ephemeris& k, double t) {
        return k.state(1, 0, TdbTime{} + t).position_m.x / 1000;
    };
    const Ephemeris ab({a, b}), ba({b, a});
    CHECK(x(ab, 10) == 1);
    CHECK(x(ab, 52) == 2);
    CHECK(x(ab, 57) == 3);
    CHECK(x(ab, 70) == 3);
    CHECK(x(ab, 90) == 1);
    CHECK(x(ba, 57) == 2);
    CHECK(x(ba, 70) == 1);
    CHECK(ab.coverage(1) == std::vector<Interval>{{0, 100}});
}

TEST_CASE("States go through the nearest common centre") {
    const test::TempFolder folder;
    const auto fixed = [](double x, std::int32_t target, std::int32_t center) {
        return segment(2, 0, 10, {5, 5, x, 0, 0, 0, 10, 5, 1}, target, center);
    };
    // 0 <- 5 <- 599, 501; no way from 5 to 0 is needed between the two.
    const Ephemeris kernels = load(folder, {fixed(7, 599, 5), fixed(400, 501, 5), fixed(-3, -98, 501)});
    const TdbTime t{5, 0};
    CHECK(kernels.state(501, 599, t).position_m.x == 393e3);
    CHECK(kernels.state(-98, 599, t).position_m.x == 390e3);
    CHECK(kernels.state(599, -98, t).position_m.x == -390e3);
    CHECK(kernels.state(-98, 501, t).position_m.x == -3e3);
    State s;
    CHECK(kernels.state(501, 10, t, s) == Evaluation::no_data);
    CHECK(message_of([&] { (void)kernels.state(501, 10, t); }) ==
          "IO (501) relative to SUN (10) at 2000-01-01T12:00:05.000 TDB: no kernel has positions of JUPITER "
          "BARYCENTER (5)");
    CHECK(kernels.state(501, 599, {11, 0}, s) == Evaluation::no_coverage);
    CHECK(message_of([&] {
              (void)kernels.state(501, 599, {11, 0});
          }) == "IO (501) relative to JUPITER (599) at 2000-01-01T12:00:11.000 TDB: IO (501) is covered "
                "2000-01-01T12:00:00.000 TDB to 2000-01-01T12:00:10.000 TDB");
}

TEST_CASE("Segments in other inertial frames are turned to ICRF axes") {
    const test::TempFolder folder;
    DafSegment s = segment(3, 0, 10, {5, 5, 0, 1, 0, 0, 2, 0, 0, 10, 8, 1});
    s.integers[2] = 17; // ECLIPJ2000
    const Ephemeris kernels = load(folder, {s});
    const State state = kernels.state(1, 0, {5, 0});
    const double e = 84381.448 / 3600 * std::numbers::pi / 180;
    CHECK(length(state.position_m - Vec3{0, std::cos(e), std::sin(e)} * 1000.0) < 1e-9);
    CHECK(length(state.velocity_m_s - Vec3{0, std::cos(e), std::sin(e)} * 2000.0) < 1e-9);
}

TEST_CASE("Damaged, truncated and foreign SPK files are refused with file and place") {
    const test::TempFolder folder;
    const std::string good = test::daf_bytes("SPK", {sampled_segment(13, 230, 8, cubic)}, false);
    const auto refusal = [&](const std::string& bytes) {
        const auto file = folder.write("bad.bsp", bytes);
        const std::string text = message_of([&] { (void)Ephemeris({file}); });
        CHECK(text.find('\n') == std::string::npos);
        return text.substr(text.find("bad.bsp"));
    };
    CHECK_THAT(refusal(good.substr(0, good.size() / 2)), ContainsSubstring("truncated"));
    CHECK_THAT(refusal(good.substr(0, 1500)), ContainsSubstring("truncated"));
    CHECK_THAT(refusal(good.substr(0, 700)), ContainsSubstring("700 bytes"));
    CHECK_THAT(refusal("SIMPLE  =                    T"), ContainsSubstring("not a SPICE kernel"));
    CHECK_THAT(refusal(std::string("\x7f"
                                   "ELF\0\0",
                                   6)),
               ContainsSubstring("not a SPICE kernel"));
    CHECK_THAT(refusal("DAF/EK  " + good.substr(8)), ContainsSubstring("'DAF/EK'"));
    std::string vax = good;
    vax.replace(88, 8, "VAX-GFLT");
    CHECK_THAT(refusal(vax), ContainsSubstring("allowed LTL-IEEE, BIG-IEEE"));
    const std::string transfer = "DAFETF NAIF DAF ENCODED TRANSFER FILE\n'DAF/SPK '\n";
    CHECK_THAT(refusal(transfer + "'1'\n'6'\n'x'\n"), ContainsSubstring("a SPK kernel has 2 and 6"));
    CHECK_THAT(refusal(transfer + "'2'\n'6'\n'x'\nBEGIN_ARRAY 1 2\n'A'\n'1^1'\n"),
               ContainsSubstring("the file ends early"));
    std::string text_mode = good;
    text_mode.replace(706, 1, "\n");
    CHECK_THAT(refusal(text_mode), ContainsSubstring("binary mode"));
    // A damaged segment is refused when it is asked for.
    const auto of = [&](const DafSegment& s) {
        const auto file = folder.write("bad.bsp", test::daf_bytes("SPK", {s}, false));
        const std::string text =
            message_of([&] { (void)Ephemeris({file}).state(1, 0, TdbTime{} + s.doubles[0]); });
        CHECK(text.find('\n') == std::string::npos);
        return text.substr(text.find("bad.bsp"));
    };
    CHECK(
        of(segment(11, 0, 1, {1, 2, 3})) ==
        "bad.bsp: segment 1 (TEST): SPK type 11 is not supported, allowed 1, 2, 3, 5, 8, 9, 10, 12, 13, 14, 15, 17, "
        "18, 19, 20, 21");
    DafSegment twice = sampled_segment(9, 20, 4, cubic);
    twice.words[20 * 6 + 7] = twice.words[20 * 6 + 6];
    CHECK_THAT(of(twice),
               ContainsSubstring("time 8 of 20 is") && ContainsSubstring("not after the one before"));
    DafSegment many = sampled_segment(9, 20, 4, cubic);
    many.words.back() = 1e9;
    CHECK_THAT(of(many), ContainsSubstring("states, allowed 1 to"));
    DafSegment nan = chebyshev_segment(2, 0, 2, cubic);
    nan.words[nan.words.size() - 3] = std::nan("");
    CHECK_THAT(of(nan), ContainsSubstring("records start at"));
    DafSegment empty = segment(21, 0, 1, {1});
    CHECK_THAT(of(empty), ContainsSubstring("bad.bsp: segment 1 (TEST): 1 values"));
}

TEST_CASE("Values that are no numbers are found when they are used") {
    const test::TempFolder folder;
    DafSegment bad = chebyshev_segment(2, 0, 3, cubic);
    bad.words[14 + 3] = std::nan("");
    bad.words[28 + 1] = 0;
    const Ephemeris kernels = load(folder, {bad});
    State s;
    CHECK(kernels.state(1, 0, {100, 0}, s) == Evaluation::ok);
    CHECK(kernels.state(1, 0, {600, 0}, s) == Evaluation::damaged);
    CHECK(kernels.state(1, 0, {1100, 0}, s) == Evaluation::damaged);
}

} // namespace spk_test
