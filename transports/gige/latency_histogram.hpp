// Counts spans of time in logarithmic bins, for quantiles without storing every value.
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cstddef>
#include <cstdint>

namespace obscura::transports::gige {

/// 16 bins per octave: a quantile is exact to 6 %. One writer, any number of readers; no locks.
class LatencyHistogram {
public:
    void add(std::int64_t span_ns) noexcept {
        const auto v = static_cast<std::uint64_t>(std::max<std::int64_t>(span_ns, 0));
        bins_[bin_of(v)].fetch_add(1, std::memory_order_relaxed);
        count_.fetch_add(1, std::memory_order_relaxed);
        if (v > maximum_.load(std::memory_order_relaxed)) maximum_.store(v, std::memory_order_relaxed);
    }
    [[nodiscard]] std::uint64_t count() const noexcept { return count_.load(std::memory_order_relaxed); }
    [[nodiscard]] std::int64_t maximum_ns() const noexcept {
        return static_cast<std::int64_t>(maximum_.load(std::memory_order_relaxed));
    }
    /// Upper edge of the bin that holds the quantile `q` in (0,1]; 0 without values.
    [[nodiscard]] std::int64_t quantile_ns(double q) const noexcept {
        const std::uint64_t total = count();
        if (total == 0) return 0;
        const auto rank = static_cast<std::uint64_t>(q * static_cast<double>(total) + 0.999999);
        std::uint64_t seen = 0;
        for (std::size_t i = 0; i < bins_.size(); ++i) {
            seen += bins_[i].load(std::memory_order_relaxed);
            if (seen >= std::max<std::uint64_t>(rank, 1)) return std::min(upper_edge(i), maximum_ns());
        }
        return maximum_ns();
    }

private:
    static constexpr std::size_t per_octave = 16;
    static std::size_t bin_of(std::uint64_t v) noexcept {
        if (v < per_octave) return v;
        const auto octave = static_cast<std::size_t>(std::bit_width(v)) - 5; // v >> octave lies in [16, 32)
        return per_octave * octave + (v >> octave);
    }
    static std::int64_t upper_edge(std::size_t bin) noexcept {
        if (bin < per_octave) return static_cast<std::int64_t>(bin);
        const std::size_t octave = bin / per_octave - 1;
        return static_cast<std::int64_t>(((std::uint64_t{bin % per_octave + per_octave} + 1) << octave) - 1);
    }
    std::array<std::atomic<std::uint64_t>, per_octave * 60> bins_{};
    std::atomic<std::uint64_t> count_{0}, maximum_{0};
};

} // namespace obscura::transports::gige
