// SPDX-License-Identifier: Apache-2.0
#include "core/realtime/latency_histogram.hpp"
#include "tests/support/catch.hpp"

#include <algorithm>
#include <cstdint>
#include <numeric>
#include <vector>

namespace latency_histogram_test {

using obscura::LatencyHistogram;

TEST_CASE("every span falls into the bucket that reaches up to it") {
    for (std::int64_t v = 0; v < 100'000; ++v) {
        const std::size_t b = LatencyHistogram::bucket_of(v);
        REQUIRE(LatencyHistogram::upper_end(b) >= v);
        if (b > 0) {
            REQUIRE(LatencyHistogram::upper_end(b - 1) < v);
        }
    }
    for (std::int64_t v = 100'000; v < INT64_MAX / 2; v += v / 7) {
        const std::size_t b = LatencyHistogram::bucket_of(v);
        REQUIRE(LatencyHistogram::upper_end(b) >= v);
        REQUIRE(LatencyHistogram::upper_end(b - 1) < v);
        // Relative width of a bucket: 1/16.
        REQUIRE(LatencyHistogram::upper_end(b) - v <= v / 16);
    }
    CHECK(LatencyHistogram::bucket_of(-5) == 0);
    CHECK(LatencyHistogram::bucket_of(INT64_MAX) == LatencyHistogram::bucket_count - 1);
}

TEST_CASE("quantiles agree with the sorted spans") {
    LatencyHistogram histogram;
    CHECK(histogram.quantile_ns(0.5) == 0);
    std::vector<std::int64_t> spans;
    std::uint64_t x = 88172645463325252ULL;
    for (int i = 0; i < 20'000; ++i) {
        x ^= x << 13, x ^= x >> 7, x ^= x << 17; // xorshift64
        spans.push_back(static_cast<std::int64_t>(x >> (20 + x % 30)));
        histogram.add(spans.back());
    }
    std::sort(spans.begin(), spans.end());
    for (const double q : {0.01, 0.5, 0.9, 0.99, 0.999, 1.0}) {
        const auto exact = spans[static_cast<std::size_t>(q * 20'000) - 1];
        CHECK(histogram.quantile_ns(q) >= exact);
        CHECK(histogram.quantile_ns(q) <= exact + exact / 16 + 1);
    }
    const LatencyHistogram::Shown up_to = histogram.up_to_bounds();
    for (std::size_t k = 0; k < up_to.size(); ++k) {
        const double bound_ns = obscura::latency_bounds_us[k] * 1e3;
        const auto end = std::upper_bound(spans.begin(), spans.end(), bound_ns, [](double a, std::int64_t b) {
            return a < static_cast<double>(b);
        });
        CHECK(up_to[k] == static_cast<std::uint64_t>(end - spans.begin()));
    }
    CHECK(histogram.sum_ns() == std::accumulate(spans.begin(), spans.end(), std::int64_t{0}));
    CHECK(histogram.max_ns() == spans.back());
    CHECK(histogram.count() == 20'000);
    LatencyHistogram few; // the middle one of three is the median
    for (const std::int64_t span : {1, 2, 3})
        few.add(span);
    CHECK(few.quantile_ns(0.5) == 2);
}

} // namespace latency_histogram_test
