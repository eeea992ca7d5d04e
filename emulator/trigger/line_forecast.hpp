// SPDX-License-Identifier: Apache-2.0
// Forecast of the edges of an input line, whether or not frames are made of them.
#pragma once

#include "emulator/trigger/edge_predictor.hpp"
#include "sync/sync.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

namespace obscura::emulator {

/// Next edge of each direction, by the schedule of the source or by the edges so far. The source's thread
/// adds; next() is for any thread and may see values of two consecutive edges. Real-time safe.
class LineForecast {
public:
    void add(const sync::Trigger& trigger) noexcept {
        Direction& d = directions_[trigger.falling ? 1 : 0];
        d.predictor.add(trigger.edge);
        const bool scheduled = trigger.next != sync::Trigger::unknown_edge;
        const std::optional<Time> next = scheduled ? std::optional(trigger.next) : d.predictor.next();
        d.period_ns.store(next ? *next - trigger.edge : 0, std::memory_order_relaxed);
        d.next_ns.store(next ? next->ns : unknown, std::memory_order_release);
    }
    /// The first edge after `t`, if edges go on as they did.
    [[nodiscard]] std::optional<Time> next(bool falling, Time t) const noexcept {
        const Direction& d = directions_[falling ? 1 : 0];
        const std::int64_t next_ns = d.next_ns.load(std::memory_order_acquire);
        const std::int64_t period_ns = d.period_ns.load(std::memory_order_relaxed);
        if (next_ns == unknown || period_ns <= 0) return std::nullopt;
        if (next_ns > t.ns) return Time{next_ns};
        return Time{next_ns + ((t.ns - next_ns) / period_ns + 1) * period_ns};
    }

private:
    static constexpr std::int64_t unknown = INT64_MIN;
    struct Direction {
        EdgePredictor predictor; ///< source's thread
        std::atomic<std::int64_t> next_ns{unknown}, period_ns{0};
    };
    std::array<Direction, 2> directions_;
};

} // namespace obscura::emulator
