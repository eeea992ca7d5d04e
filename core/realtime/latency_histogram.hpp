// SPDX-License-Identifier: Apache-2.0
// Lock-free histogram of time spans, for quantiles without storing every value.
#pragma once

#include "core/time.hpp"

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace obscura {

/// Upper ends of the buckets that reports and metrics show, us; one more bucket holds longer spans.
inline constexpr std::array latency_bounds_us{1.,  2.,  5.,  1e1, 2e1, 5e1, 1e2, 2e2, 5e2, 1e3,
                                              2e3, 5e3, 1e4, 2e4, 5e4, 1e5, 2e5, 5e5, 1e6};
/// Number of the bucket of a span among those.
[[nodiscard]] std::size_t shown_bucket_of(double span_us) noexcept;

/// Counts spans in buckets of 1/16 of an octave and at least 1 ns, so quantiles are exact within 6.25 %. One
/// adding thread at a time, any number of readers; real-time safe.
class LatencyHistogram {
public:
    void add(std::int64_t span_ns) noexcept;
    [[nodiscard]] std::uint64_t count() const noexcept { return count_.load(std::memory_order_relaxed); }
    /// Upper end of the bucket that holds the quantile `q` in (0, 1], but no more than max_ns(); 0 when
    /// empty.
    [[nodiscard]] std::int64_t quantile_ns(double q) const noexcept;
    [[nodiscard]] std::int64_t max_ns() const noexcept { return max_.load(std::memory_order_relaxed); }
    /// Sum of all spans; negative ones count as 0.
    [[nodiscard]] std::int64_t sum_ns() const noexcept { return sum_.load(std::memory_order_relaxed); }
    /// Spans up to each of latency_bounds_us, exactly.
    using Shown = std::array<std::uint64_t, latency_bounds_us.size()>;
    [[nodiscard]] Shown up_to_bounds() const noexcept;

    /// Bucket of a span, and the largest span that falls into a bucket.
    [[nodiscard]] static std::size_t bucket_of(std::int64_t span_ns) noexcept;
    [[nodiscard]] static std::int64_t upper_end(std::size_t bucket) noexcept;
    static constexpr std::size_t bucket_count = 16 * 60;
    [[nodiscard]] std::uint64_t in_bucket(std::size_t bucket) const noexcept {
        return buckets_[bucket].load(std::memory_order_relaxed);
    }

private:
    std::array<std::atomic<std::uint64_t>, bucket_count> buckets_{};
    std::atomic<std::uint64_t> count_{0};
    std::atomic<std::int64_t> max_{0}, sum_{0};
    std::array<std::atomic<std::uint64_t>, latency_bounds_us.size() + 1> shown_{};
};

} // namespace obscura
