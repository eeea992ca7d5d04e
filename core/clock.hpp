// SPDX-License-Identifier: Apache-2.0
// Scheduling clock interface, CLOCK_MONOTONIC, and a simulated clock that runs hours of triggers in seconds.
#pragma once

#include "core/tai_source.hpp"
#include "core/time.hpp"

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace obscura {

/// A clock that can be read and slept on. Thread-safe.
class Clock {
public:
    virtual ~Clock() = default;

    [[nodiscard]] virtual Time now() const noexcept = 0;

    /// Blocks until `deadline` or until interrupt() is called. Returns true when the deadline was reached.
    /// Does not allocate.
    virtual bool sleep_until(Time deadline) noexcept = 0;

    /// Wakes all sleepers and makes later sleeps return false at once, until rearm().
    virtual void interrupt() noexcept = 0;
    virtual void rearm() noexcept = 0;

    /// TAI minus this clock, in ns. Where the kernel has no TAI offset, and no correction is set, TAI equals
    /// UTC (CLOCK_REALTIME).
    [[nodiscard]] virtual std::int64_t tai_offset_ns() const noexcept = 0;
};

/// CLOCK_MONOTONIC. Sleeps on a futex with an absolute time-out, so that interrupt() needs no signal.
class MonotonicClock final : public Clock {
public:
    [[nodiscard]] Time now() const noexcept override;
    bool sleep_until(Time deadline) noexcept override;
    void interrupt() noexcept override;
    void rearm() noexcept override;
    [[nodiscard]] std::int64_t tai_offset_ns() const noexcept override;
    /// Correction added to tai_offset_ns() from now on, for a kernel whose TAI offset is unset. Thread-safe.
    void set_tai_correction(TaiCorrection correction) noexcept {
        tai_correction_ns_.store(correction.ns);
        tai_source_.store(correction.source);
    }
    /// Source of the correction; unknown before the first one.
    [[nodiscard]] TaiSource tai_source() const noexcept { return tai_source_.load(); }

private:
    std::atomic<std::uint32_t> interrupted_{0};
    std::atomic<std::int64_t> tai_correction_ns_{0};
    std::atomic<TaiSource> tai_source_{TaiSource::unknown};
};

/// Simulated clock that moves only by advance_to(). In `auto_advance` mode a sleep sets the clock to its
/// deadline at once, for single-threaded simulation; otherwise sleepers wait until advance_to() reaches their
/// deadline.
class FakeClock final : public Clock {
public:
    explicit FakeClock(Time start = {}, bool auto_advance = false)
        : now_(start), auto_advance_(auto_advance) {}

    [[nodiscard]] Time now() const noexcept override;
    bool sleep_until(Time deadline) noexcept override;
    void interrupt() noexcept override;
    void rearm() noexcept override;
    [[nodiscard]] std::int64_t tai_offset_ns() const noexcept override;

    /// Moves the clock forward to `t` (never back) and wakes the sleepers whose deadline has come.
    void advance_to(Time t);
    void advance(std::int64_t span_ns) { advance_to(now() + span_ns); }
    /// Steps the TAI offset, as a leap second or a clock step would.
    void set_tai_offset_ns(std::int64_t offset_ns);
    /// Number of threads now blocked in sleep_until().
    [[nodiscard]] int sleepers() const;

private:
    mutable std::mutex mutex_;
    std::condition_variable changed_;
    Time now_;
    std::int64_t tai_offset_ns_ = 0;
    int sleepers_ = 0;
    bool auto_advance_;
    bool interrupted_ = false;
};

} // namespace obscura
