// SPDX-License-Identifier: Apache-2.0
#include "transports/watch/saturation_counts.hpp"

#include <algorithm>
#include <span>

namespace obscura::transports {

void SaturationCounts::want(Time until) noexcept {
    until_ns_.store(until.ns, std::memory_order_relaxed);
}

bool SaturationCounts::wanted(Time now) const noexcept {
    return now.ns <= until_ns_.load(std::memory_order_relaxed);
}

void SaturationCounts::note(const Frame& frame, Time now) {
    if (!wanted(now)) return;
    const auto there =
        static_cast<std::size_t>(frame.rows_ready()) * static_cast<std::size_t>(frame.info.width);
    const std::span<const std::uint16_t> pixels = frame.pixels();
    const unsigned full = (1U << static_cast<unsigned>(frame.info.bits_per_pixel)) - 1;
    std::uint32_t count = 0;
    for (const std::uint16_t dn : pixels.first(std::min(there, pixels.size())))
        count += dn >= full ? 1U : 0U;
    const std::lock_guard lock(mutex_);
    entries_[next_] = {frame.info.frame_id, frame.info.trigger_edge, count};
    next_ = (next_ + 1) % most;
}

std::optional<std::uint32_t> SaturationCounts::of(std::uint64_t frame_id, Time edge) const {
    const std::lock_guard lock(mutex_);
    for (const Entry& entry : entries_)
        if (entry.frame_id == frame_id && entry.frame_id != 0 && entry.edge == edge) return entry.pixels;
    return std::nullopt;
}

} // namespace obscura::transports
