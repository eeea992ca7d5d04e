// SPDX-License-Identifier: Apache-2.0
#include "core/realtime/latency_histogram.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace obscura {

std::size_t shown_bucket_of(double span_us) noexcept {
    return static_cast<std::size_t>(
        std::lower_bound(latency_bounds_us.begin(), latency_bounds_us.end(), span_us) -
        latency_bounds_us.begin());
}

std::size_t LatencyHistogram::bucket_of(std::int64_t span_ns) noexcept {
    const auto v = static_cast<std::uint64_t>(std::max<std::int64_t>(span_ns, 0));
    if (v < 16) return static_cast<std::size_t>(v);
    // The leading bit selects the octave, the next four bits the bucket inside it.
    const int octave = std::bit_width(v) - 5;
    return std::min(static_cast<std::size_t>(16 * octave) + static_cast<std::size_t>(v >> octave),
                    bucket_count - 1);
}

std::int64_t LatencyHistogram::upper_end(std::size_t bucket) noexcept {
    if (bucket < 32) return static_cast<std::int64_t>(bucket);
    const std::size_t octave = bucket / 16 - 1;
    return static_cast<std::int64_t>(((16 + bucket % 16 + 1) << octave) - 1);
}

void LatencyHistogram::add(std::int64_t span_ns) noexcept {
    buckets_[bucket_of(span_ns)].fetch_add(1, std::memory_order_relaxed);
    shown_[shown_bucket_of(static_cast<double>(span_ns) * 1e-3)].fetch_add(1, std::memory_order_relaxed);
    sum_.fetch_add(std::max<std::int64_t>(span_ns, 0), std::memory_order_relaxed);
    if (span_ns > max_.load(std::memory_order_relaxed)) max_.store(span_ns, std::memory_order_relaxed);
    count_.fetch_add(1, std::memory_order_relaxed);
}

LatencyHistogram::Shown LatencyHistogram::up_to_bounds() const noexcept {
    Shown up_to{};
    std::uint64_t sum = 0;
    for (std::size_t k = 0; k < up_to.size(); ++k)
        up_to[k] = sum += shown_[k].load(std::memory_order_relaxed);
    return up_to;
}

std::int64_t LatencyHistogram::quantile_ns(double q) const noexcept {
    const std::uint64_t total = count();
    if (total == 0) return 0;
    const auto wanted =
        std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::ceil(q * static_cast<double>(total))));
    std::uint64_t seen = 0;
    for (std::size_t b = 0; b < bucket_count; ++b) {
        seen += in_bucket(b);
        if (seen >= wanted) return std::min(upper_end(b), max_ns());
    }
    return max_ns();
}

} // namespace obscura
