// SPDX-License-Identifier: Apache-2.0
// Edge ids per trigger route, renumbered so that the gate counts only lost edges as gaps.
#pragma once

#include "emulator/trigger/trigger_route.hpp"
#include "sync/sync.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <optional>

namespace obscura::emulator {

/// Edges that TriggerDivider skips, or that another trigger than the frame's consumes, are not lost ones.
/// Each route's members belong to the thread of its source and are real-time safe; reset() to the control
/// side, while the gate is closed.
class EdgeNumbers {
public:
    /// An acquisition starts.
    void reset() noexcept {
        for (Route& route : routes_) {
            route.first.store(0, std::memory_order_relaxed);
            route.consumed.store(0, std::memory_order_relaxed);
        }
    }
    /// An edge of `route` has served a trigger other than the one that makes frames.
    void consume(TriggerRoute route) noexcept {
        routes_[route].consumed.fetch_add(1, std::memory_order_relaxed);
    }
    /// `trigger` with its id less the edges consumed so far.
    [[nodiscard]] sync::Trigger without_consumed(sync::Trigger trigger, TriggerRoute route) const noexcept {
        const std::uint64_t consumed = routes_[route].consumed.load(std::memory_order_relaxed);
        if (trigger.id > consumed) trigger.id -= consumed;
        return trigger;
    }
    /// SFNC TriggerDivider: of the edges of an acquisition the first counts, then every `divider`-th; empty
    /// for the others.
    [[nodiscard]] std::optional<sync::Trigger> divided(sync::Trigger trigger, TriggerRoute route,
                                                       std::uint32_t divider) noexcept {
        std::uint64_t first = routes_[route].first.load(std::memory_order_relaxed);
        if (first == 0) routes_[route].first.store(first = trigger.id, std::memory_order_relaxed);
        const std::uint64_t n = trigger.id - first;
        if (n % divider != 0) return std::nullopt;
        trigger.id = n / divider + 1;
        return trigger;
    }

private:
    struct Route {
        std::atomic<std::uint64_t> first{0}; ///< id of the acquisition's first edge; 0: none yet
        std::atomic<std::uint64_t> consumed{0};
    };
    std::array<Route, free_run_route> routes_{};
};

} // namespace obscura::emulator
