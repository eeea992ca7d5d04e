// SPDX-License-Identifier: Apache-2.0
// Prediction of trigger edges: exact series, jitter, drift, missing edges and jumps.
#include "emulator/trigger/edge_predictor.hpp"
#include "tests/support/catch.hpp"

#include <cmath>
#include <random>

namespace edge_predictor_test {

using namespace obscura;
using namespace obscura::emulator;

namespace {

constexpr std::int64_t ms = ns_per_ms;
constexpr Time start{1'000'000'000'000};

/// Root mean square error of predictions, ns, over the last half of `edges`.
double error_ns(const std::vector<Time>& edges) {
    EdgePredictor predictor;
    double sum = 0;
    int count = 0;
    for (std::size_t i = 0; i < edges.size(); ++i) {
        if (const std::optional<Time> next = predictor.next(); next && i >= edges.size() / 2) {
            const auto off = static_cast<double>(edges[i] - *next);
            sum += off * off;
            ++count;
        }
        predictor.add(edges[i]);
    }
    REQUIRE(count > 0);
    return std::sqrt(sum / count);
}

} // namespace

TEST_CASE("edges of a constant period are predicted to the nanosecond, from the fourth on") {
    EdgePredictor predictor;
    CHECK(predictor.empty());
    for (int i = 0; i < 1000; ++i) {
        const std::int64_t third = (100 * ms * i + 1) / 3; // 30 Hz, rounded
        if (i < 3)
            CHECK_FALSE(predictor.next());
        else
            CHECK(std::abs(*predictor.next() - (start + third)) <= 2);
        predictor.add(start + third);
    }
}

TEST_CASE("jitter is averaged, and drift is followed") {
    std::mt19937_64 engine(3);
    std::normal_distribution<double> jitter(0, 1e6);
    std::vector<Time> noisy, drifting;
    for (int i = 0; i < 4000; ++i) {
        const double t = 1e8 * i;
        noisy.push_back(start + static_cast<std::int64_t>(t + jitter(engine)));
        drifting.push_back(start + static_cast<std::int64_t>(t + 50e-6 * t * std::sin(t * 1e-12)));
    }
    // The best that can be is the jitter of the edge itself; the loop's own comes on top.
    CHECK(error_ns(noisy) > 0.98e6);
    CHECK(error_ns(noisy) < 1.25e6);
    CHECK(error_ns(drifting) < 2000);
}

TEST_CASE("missing edges count as periods, and a jump begins anew") {
    EdgePredictor predictor;
    for (int i = 0; i < 10; ++i)
        predictor.add(start + 100 * ms * i);
    predictor.add(start + 100 * ms * 14);
    CHECK(*predictor.next() == start + 100 * ms * 15);
    // Half a period off: nothing is predicted until the series shows itself again.
    predictor.add(start + 1550 * ms);
    CHECK_FALSE(predictor.next());
    predictor.add(start + 1650 * ms);
    predictor.add(start + 1750 * ms);
    CHECK(*predictor.next() == start + 1850 * ms);
    // So does a doubled edge, and one from before.
    predictor.add(start + 1751 * ms);
    CHECK_FALSE(predictor.next());
    predictor.add(start);
    CHECK_FALSE(predictor.next());
    predictor.restart();
    CHECK(predictor.empty());
}

} // namespace edge_predictor_test
