// SPDX-License-Identifier: Apache-2.0
#include "core/math/vector_functions.hpp"
#include "core/philox.hpp"
#include "tests/support/catch.hpp"

#include <cmath>

namespace vector_functions_test {

using namespace obscura;
using namespace obscura::renderer;

namespace {

double uniform(std::uint32_t n) {
    return uniform_double(philox4x32({n, 0, 0, 0}, {3, 4})[0]);
}

} // namespace

TEST_CASE("vector_exp, vector_log and vector_pow agree with the long double library") {
    double worst_exp = 0;
    double worst_log = 0;
    double worst_pow = 0;
    for (std::uint32_t n = 0; n < 200'000; ++n) {
        const double x = -690 + 1380 * uniform(n);
        const auto e = std::exp(static_cast<long double>(x));
        worst_exp = std::fmax(worst_exp, static_cast<double>(std::fabs(vector_exp<double>(x) / e - 1)));
        const double y = std::exp(-40 + 80 * uniform(n + 1'000'000));
        const auto l = std::log(static_cast<long double>(y));
        worst_log = std::fmax(worst_log, static_cast<double>(std::fabs(vector_log<double>(y) - l) /
                                                             std::fmax(1e-3L, std::fabs(l))));
        const double base = uniform(n + 2'000'000);
        const double power = 200 * uniform(n + 3'000'000);
        const auto p = std::pow(static_cast<long double>(base), static_cast<long double>(power));
        if (p > 1e-200L)
            worst_pow = std::fmax(worst_pow, static_cast<double>(std::fabs(vector_pow(base, power) / p - 1)));
    }
    CHECK(worst_exp < 1e-15);
    CHECK(worst_log < 1e-13); // near 1 the logarithm itself is near 0
    CHECK(worst_pow < 1e-12);
    CHECK(vector_exp<double>(0) == 1);
    CHECK(vector_exp<double>(-1e9) < 1e-300);
    CHECK(vector_log<double>(1) == 0);
}

TEST_CASE("vector_acos agrees with the library over the whole range, and clamps") {
    double worst = 0;
    for (int n = -100'000; n <= 100'000; ++n) {
        const double x = n / 100'000.0;
        worst = std::fmax(worst, std::fabs(vector_acos<double>(x) - std::acos(x)));
    }
    CHECK(worst < 1e-13);
    CHECK(vector_acos<double>(1.5) == 0);
    CHECK(vector_acos<double>(-1.5) == std::acos(-1.0));
}

TEST_CASE("the quick functions keep their promises") {
    double worst_exp = 0;
    double worst_log = 0;
    double worst_acos = 0;
    for (std::uint32_t n = 0; n < 200'000; ++n) {
        const double x = -690 + 700 * uniform(n + 4'000'000);
        const double e = std::exp(x);
        worst_exp = std::fmax(worst_exp, std::fabs(quick_exp(x) / e - 1));
        const double y = std::exp(-600 + 602 * uniform(n + 5'000'000));
        worst_log = std::fmax(worst_log, std::fabs(quick_log_1_plus_inverse(y) / std::log1p(1 / y) - 1));
        const double c = -1 + 2 * uniform(n + 6'000'000);
        worst_acos = std::fmax(worst_acos, std::fabs(quick_acos(c) - std::acos(c)));
    }
    CHECK(worst_exp < 5e-10);
    CHECK(worst_log < 2e-11);
    CHECK(worst_acos < 8e-11);
    CHECK(quick_acos(1) == 0);
    CHECK(quick_exp(-1e9) < 1e-300);
}

} // namespace vector_functions_test
