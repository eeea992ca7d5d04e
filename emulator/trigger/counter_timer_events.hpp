// SPDX-License-Identifier: Apache-2.0
// Trigger events from the ends of SFNC counters and timers.
#pragma once

#include "core/camera/io_state.hpp"
#include "core/clock.hpp"
#include "emulator/trigger/alarm.hpp"
#include "emulator/trigger/frame_moments.hpp"
#include "sync/sync.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <mutex>

namespace obscura::emulator {

/// Finds the ends of counters and timers by a scan on the alarm thread, off the trigger path, whenever an
/// event may have happened that they listen to. One control thread configures.
class CounterTimerEvents {
public:
    /// The camera that the counters and timers belong to.
    class Host {
    public:
        virtual ~Host() = default;
        /// State of the inputs that counters and timers listen to. Thread-safe, real-time safe.
        [[nodiscard]] virtual IoInputs io_inputs() const noexcept = 0;
        /// Counter or timer `source` has ended; `end.id` counts its ends. Alarm thread: must be real-time
        /// safe.
        virtual void on_end(TriggerSource source, const sync::Trigger& end) noexcept = 0;
    };

    static constexpr std::size_t alarm_count = 4 + timer_count;

    /// Uses alarm_count alarms from `first_alarm` on, whose expiry is on_alarm(). The references must outlive
    /// this object.
    CounterTimerEvents(Host& host, const Clock& clock, AlarmPort& alarms, std::size_t first_alarm)
        : host_(host), clock_(clock), alarms_(alarms), first_alarm_(first_alarm) {}

    // Control side.

    void set(const CameraSettings& settings);
    void reset_counter(std::size_t i) noexcept;
    void reset_timer(std::size_t i) noexcept;
    /// Resets the counters whose CounterResetSource is AcquisitionStart.
    void acquisition_start() noexcept;

    // Any thread; real-time safe.

    void fill(CameraActivity& activity) const noexcept { marks_.fill(activity); }
    /// Reports an event that counters may count or timers start from.
    void request_scan() noexcept;
    /// Reports that a frame has begun; its instants may lie ahead.
    void frame_begun(const FrameInstants& instants) noexcept;

    // Alarm thread.

    void on_alarm(std::size_t alarm, Time due) noexcept;

private:
    enum AlarmOffset : std::size_t { now, exposure_start, exposure_end, frame_end, first_timer_end };
    static_assert(first_timer_end + timer_count == alarm_count);

    /// Baseline at configuration time; earlier events are ignored.
    struct Counter {
        EventCounter set_up;
        std::uint64_t base = 0, ended = 0;
    };
    struct Timer {
        PulseTimer set_up;
        Time started;
    };

    /// No counter and no timer listens to anything.
    [[nodiscard]] bool idle() const noexcept { return idle_.load(std::memory_order_relaxed); }
    void set_alarm(std::size_t offset, Time due) noexcept { alarms_.set(first_alarm_ + offset, due); }
    void take_over_settings() noexcept;
    void scan() noexcept;
    std::uint64_t new_counter_ends(std::size_t i, const IoInputs& in, Time& last) noexcept;
    bool timer_started(std::size_t i, const IoInputs& in, Time& end) noexcept;
    bool timer_runs(std::size_t i, const IoInputs& in) noexcept;
    void emit(std::size_t end, Time t) noexcept;

    Host& host_;
    const Clock& clock_;
    AlarmPort& alarms_;
    const std::size_t first_alarm_;

    IoMarks marks_;
    /// Guards the configured values; the alarm thread only tries to lock it.
    std::mutex mutex_;
    std::array<Counter, counter_count> configured_counters_;
    std::array<Timer, timer_count> configured_timers_;
    std::atomic<bool> idle_{true};
    // Alarm thread.
    std::array<Counter, counter_count> counters_;
    std::array<Timer, timer_count> timers_;
    std::array<std::uint64_t, counter_count + timer_count> end_ids_{};
};

} // namespace obscura::emulator
