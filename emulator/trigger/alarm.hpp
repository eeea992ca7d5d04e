// SPDX-License-Identifier: Apache-2.0
// Timer thread: calls a handler at instants that other threads set.
#pragma once

#include "core/clock.hpp"
#include "core/realtime/event_count.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/realtime/realtime.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <thread>

namespace obscura::emulator {

/// A fixed number of one-shot alarms. All members are thread-safe and real-time safe.
class AlarmPort {
public:
    static constexpr std::size_t alarm_count = 8;
    /// Called at each expiry, always on the same thread, which is real-time: must be real-time safe. It may
    /// set and clear alarms.
    using Handler = std::function<void(std::size_t alarm, Time due)>;
    /// Makes the alarms that call `handler`.
    using Make = std::function<std::unique_ptr<AlarmPort>(Handler handler)>;

    virtual ~AlarmPort() = default; ///< implementations stop first
    /// Stops the alarms; the handler is not called after the return. Must not be called on the handler's
    /// thread.
    virtual void stop() noexcept = 0;
    /// Sets the expiry of `alarm`; replaces an instant that has not expired yet.
    virtual void set(std::size_t alarm, Time due) noexcept = 0;
    virtual void clear(std::size_t alarm) noexcept = 0;
    /// Heartbeat of the handler's thread.
    [[nodiscard]] virtual const Heartbeat& heartbeat() const noexcept = 0;
};

/// Alarms on CLOCK_MONOTONIC, with a thread of their own.
class Alarm final : public AlarmPort {
public:
    Alarm(ThreadSettings thread, Handler handler);
    ~Alarm() override { stop(); }
    Alarm(const Alarm&) = delete;
    Alarm& operator=(const Alarm&) = delete;

    void stop() noexcept override;
    void set(std::size_t alarm, Time due) noexcept override;
    void clear(std::size_t alarm) noexcept override {
        due_ns_[alarm].store(never_ns, std::memory_order_release);
    }
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept override { return heartbeat_; }

private:
    static constexpr std::int64_t never_ns = INT64_MAX;
    void run() noexcept;

    const Handler handler_;
    MonotonicClock clock_;
    std::array<std::atomic<std::int64_t>, alarm_count> due_ns_{};
    std::atomic<bool> stopping_{false};
    EventCount changed_; ///< an instant was set, or stopping_
    Heartbeat heartbeat_{"alarm"};
    std::thread thread_;
};

} // namespace obscura::emulator
