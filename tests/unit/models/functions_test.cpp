// SPDX-License-Identifier: Apache-2.0
#include "models/graph/operation.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <limits>

namespace functions_test {

using namespace obscura;
using namespace obscura::models;

namespace {

/// Largest difference from the C library's function in units of the last place of its result, at least of 1.
template<typename F, typename G>
double worst(F ours, G libm, double from, double to, int steps = 20'001) {
    double most = 0;
    for (int i = 0; i < steps; ++i) {
        const double x = from + (to - from) * i / (steps - 1);
        const double expected = libm(x);
        const double unit = 0x1p-52 * std::max(1.0, std::fabs(expected));
        most = std::max(most, std::fabs(ours(x) - expected) / unit);
    }
    return most;
}
double our_sine(double x) {
    double s = 0, c = 0;
    vector_sincos(x, s, c);
    return s;
}
double our_cosine(double x) {
    double s = 0, c = 0;
    vector_sincos(x, s, c);
    return c;
}
const double no_number = std::numeric_limits<double>::quiet_NaN();
const double infinity = std::numeric_limits<double>::infinity();

} // namespace

TEST_CASE("trigonometric functions agree with the C library's", "[models]") {
    const auto sine = [](double x) { return std::sin(x); };
    const auto cosine = [](double x) { return std::cos(x); };
    CHECK(worst(our_sine, sine, -10, 10) < 1);
    CHECK(worst(our_cosine, cosine, -10, 10) < 1);
    CHECK(worst(our_sine, sine, 1e5, 1e5 + 100) < 1);
    CHECK(worst(our_cosine, cosine, -1e6, -1e6 + 100) < 1);
    CHECK(worst(
              vector_asin<double>, [](double x) { return std::asin(x); }, -1, 1) < 2);
    CHECK(worst(
              vector_atan<double>, [](double x) { return std::atan(x); }, -5, 5) < 2);
    CHECK(worst(
              vector_atan<double>, [](double x) { return std::atan(x); }, -1e6, 1e6) < 2);
    CHECK(std::fabs(vector_atan<double>(1e-9) - 1e-9) < 1e-24);
}

TEST_CASE("the angle of a point is in its quadrant", "[models]") {
    for (int i = 0; i < 1000; ++i) {
        const double angle = -3.14 + 6.28 * i / 999;
        const double x = 7 * std::cos(angle), y = 7 * std::sin(angle);
        CHECK(std::fabs(vector_atan2<double>(y, x) - std::atan2(y, x)) < 1e-15);
    }
    CHECK(vector_atan2<double>(0, 0) == 0);
    CHECK(vector_atan2<double>(0, -1) == 3.141592653589793);
    CHECK(vector_atan2<double>(2, 0) == std::atan2(2.0, 0.0));
    CHECK(std::isnan(vector_atan2<double>(no_number, 1)));
    CHECK(std::isnan(vector_atan2<double>(1, no_number)));
    CHECK(vector_atan2<double>(infinity, infinity) == std::atan2(infinity, infinity));
}

TEST_CASE("functions at the ends of their range give what the C library gives", "[models]") {
    CHECK(std::isnan(our_sine(no_number)));
    CHECK(std::isnan(our_cosine(infinity)));
    CHECK(std::isnan(our_sine(1e300)));
    CHECK(model_exp<double>(-1e5) == 0);
    CHECK(model_exp<double>(1e5) == infinity);
    CHECK(std::isnan(model_exp<double>(no_number)));
    CHECK(model_log<double>(0) == -infinity);
    CHECK(std::isnan(model_log<double>(-1)));
    CHECK(model_log<double>(infinity) == infinity);
    CHECK(std::isnan(model_log<double>(no_number)));
    for (const double x : {-2.5, -2.0, -1.0, 0.0, 0.5, 1.0, 3.0})
        for (const double y : {-3.0, -2.0, -0.5, 0.0, 0.5, 1.0, 2.0, 3.0}) {
            INFO(x << " ^ " << y);
            const double expected = std::pow(x, y);
            if (std::isfinite(expected))
                CHECK(std::fabs(model_pow<double>(x, y) - expected) <= 1e-14 * std::fabs(expected));
            else if (std::isnan(expected))
                CHECK(std::isnan(model_pow<double>(x, y)));
            else
                CHECK(std::isinf(model_pow<double>(x, y)));
        }
    CHECK(vector_asin<double>(2) == std::asin(1.0));
}

} // namespace functions_test
