// SPDX-License-Identifier: Apache-2.0
// Trigger source on an absolute schedule of a PTP clock, with a scheduled start.
#pragma once

#include "core/clock.hpp"
#include "core/realtime/realtime.hpp"
#include "sync/schedule.hpp"
#include "sync/sync.hpp"

#include <atomic>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <thread>

namespace obscura::sync {

/// Reads the scheduling clock minus another clock, in ns; no value while that clock cannot be read. Neither
/// allocates nor throws.
using ReadDifference = std::function<std::optional<std::int64_t>()>;

/// Opens the PTP clock `device` (/dev/ptpN). Throws HardwareError that names the key `device` of `table` when
/// it cannot be opened or read.
[[nodiscard]] ReadDifference open_ptp_clock(const std::string& table, const std::string& device);

struct PtpTimerSettings {
    RationalRate rate{10, 1};
    std::int64_t phase_ns = 0;
    /// Slot 0 without phase, in the other clock; empty: its next full second.
    std::optional<Time> start{};
    /// Smallest change of the difference between two readings that counts as a step of the other clock.
    std::int64_t step_ns = ns_per_ms;
    std::int64_t holdover_ns = 60 * ns_per_s; ///< longest time without reading in holdover, then free
    ThreadSettings thread{};
};

/// Parses an instant such as "1795244437.5"; no value unless it is a number of seconds from 0 to 9e9 with at
/// most nine decimals.
[[nodiscard]] std::optional<Time> parse_start(const std::string& text);

/// Slot k lies at start + k/rate + phase of the other clock, which is compared with the scheduling clock
/// before every slot and at least four times a second. A start in the past is the epoch from which slots are
/// counted. Slots missed by a late thread leave a gap in the ids; so does a forward step of the other clock,
/// while after a backward step the ids continue without repetition. Locked while the other clock can be read
/// and does not step; holdover on its last reading when it cannot be read.
class PtpTimer final : public TriggerSource {
public:
    /// `open` throws HardwareError. `clock` must be exclusive to this source: stop() interrupts it.
    PtpTimer(const PtpTimerSettings& settings, std::function<ReadDifference()> open,
             std::unique_ptr<Clock> clock);
    ~PtpTimer() override;

    [[nodiscard]] std::string_view name() const override { return "ptp_timer"; }
    void start(TriggerSink& sink) override;
    void stop() override;
    [[nodiscard]] ClockState clock_state(Time /*now*/) const noexcept override {
        return state_.load(std::memory_order_relaxed);
    }
    [[nodiscard]] Heartbeats heartbeats() const override { return {&heartbeat_}; }

    /// Slots without a trigger since start(), and steps of the other clock. Thread-safe.
    [[nodiscard]] std::uint64_t missed() const noexcept { return missed_.load(std::memory_order_relaxed); }
    [[nodiscard]] std::uint64_t steps() const noexcept { return steps_.load(std::memory_order_relaxed); }

private:
    void run(TriggerSink& sink, const ReadDifference& read, std::int64_t difference_ns) noexcept;

    const PtpTimerSettings settings_;
    const std::function<ReadDifference()> open_;
    std::unique_ptr<Clock> clock_;
    std::atomic<bool> stopping_{false};
    std::atomic<ClockState> state_{ClockState::free};
    std::atomic<std::uint64_t> missed_{0}, steps_{0};
    Heartbeat heartbeat_{"trigger-ptp"};
    std::thread thread_;
};

} // namespace obscura::sync
