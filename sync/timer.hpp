// SPDX-License-Identifier: Apache-2.0
// Trigger source on an absolute schedule of the monotonic clock.
#pragma once

#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "sync/schedule.hpp"
#include "sync/sync.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

namespace obscura::sync {

struct TimerSettings {
    RationalRate rate{10, 1};
    std::int64_t phase_ns = 0;
    std::optional<Time> start; ///< slot 0 without phase; empty: when start() is called
    ThreadSettings thread{};
};

/// Slot k of the schedule becomes the trigger with id k+1 and the slot's own instant as its edge. When the
/// thread wakes so late that further slots have passed, only the latest of them is delivered: the others are
/// a gap in the ids, never a burst of triggers. start() and stop() are thread-bound.
class TimerTrigger final : public TriggerSource {
public:
    /// `clock` must be exclusive to this source: stop() interrupts it.
    TimerTrigger(TimerSettings settings, std::unique_ptr<Clock> clock);
    ~TimerTrigger() override;

    [[nodiscard]] std::string_view name() const override { return "timer"; }
    void start(TriggerSink& sink) override;
    void stop() override;
    [[nodiscard]] Heartbeats heartbeats() const override { return {&heartbeat_}; }

    /// Slots without a trigger since start(). Thread-safe.
    [[nodiscard]] std::uint64_t missed() const noexcept { return missed_.load(std::memory_order_relaxed); }

private:
    void run(TriggerSink& sink, const Schedule& schedule) noexcept;

    TimerSettings settings_;
    std::unique_ptr<Clock> clock_;
    std::atomic<bool> stopping_{false};
    std::atomic<std::uint64_t> missed_{0};
    Heartbeat heartbeat_{"trigger-timer"};
    std::thread thread_;
};

} // namespace obscura::sync
