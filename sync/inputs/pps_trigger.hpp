// SPDX-License-Identifier: Apache-2.0
// Trigger source on a schedule synchronised to a pulse per second.
#pragma once

#include "core/clock.hpp"
#include "sync/edge_trigger.hpp"
#include "sync/inputs/pps_schedule.hpp"
#include "sync/sync.hpp"

#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <thread>

namespace obscura::sync {

/// Triggers at PPS + k/rate + phase. Nothing is triggered before the first pulse; the schedule continues
/// through missing pulses (holdover). A slot that coincides with a pulse waits for that pulse, at most
/// pulse_timeout_ns, and has its time stamp. Slots missed by a late thread leave a gap in the ids.
class PpsTrigger final : public TriggerSource {
public:
    static constexpr std::int64_t pulse_timeout_ns = 20 * ns_per_ms;

    /// `open` opens the input of the pulses. `clock` must be exclusive to this source, which interrupts it.
    PpsTrigger(const PpsSettings& settings, const ThreadSettings& thread, EdgeTrigger::Open open,
               std::unique_ptr<Clock> clock);
    ~PpsTrigger() override;

    [[nodiscard]] std::string_view name() const override { return "pps"; }
    void start(TriggerSink& sink) override;
    void stop() override;
    [[nodiscard]] Heartbeats heartbeats() const override;

    /// Thread-safe.
    [[nodiscard]] ClockState clock_state(Time /*now*/) const noexcept override {
        return state_.load(std::memory_order_relaxed);
    }
    [[nodiscard]] std::uint64_t missed() const noexcept { return missed_.load(std::memory_order_relaxed); }
    /// PpsSchedule::last_offset_ns(); none before the second pulse.
    [[nodiscard]] std::optional<std::int64_t> offset_ns() const noexcept {
        const std::int64_t ns = offset_ns_.load(std::memory_order_relaxed);
        return ns == no_offset ? std::nullopt : std::optional(ns);
    }

private:
    /// Receives the pulses on the input's thread and stores the latest for the trigger thread.
    struct Pulses final : TriggerSink {
        explicit Pulses(Clock& c) : clock(c) {}
        void on_trigger(const Trigger& t) noexcept override;
        Clock& clock;
        std::atomic<std::int64_t> latest_ns{INT64_MIN};
    };

    void run(TriggerSink& sink) noexcept;

    const PpsSettings settings_;
    const ThreadSettings thread_settings_;
    std::unique_ptr<Clock> clock_;
    Pulses pulses_;
    EdgeTrigger input_;
    std::atomic<bool> stopping_{false};
    std::atomic<ClockState> state_{ClockState::free};
    std::atomic<std::uint64_t> missed_{0};
    static constexpr std::int64_t no_offset = INT64_MIN;
    std::atomic<std::int64_t> offset_ns_{no_offset};
    Heartbeat heartbeat_{"trigger-pps"};
    std::thread thread_;
};

} // namespace obscura::sync
