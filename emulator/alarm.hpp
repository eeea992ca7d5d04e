// Timer thread: calls a handler at instants that other threads set.
#pragma once

#include "core/clock.hpp"
#include "core/event_count.hpp"
#include "core/heartbeat.hpp"
#include "core/realtime.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>

namespace obscura::emulator {

/// A fixed number of one-shot alarms. set() and clear() are thread-safe and real-time safe.
class Alarm {
public:
    static constexpr std::size_t alarm_count = 8;
    using Handler = std::function<void(std::size_t alarm, Time due)>;

    /// Calls `handler` on this object's thread, which is real-time: `handler` must be real-time safe. It may
    /// set and clear alarms.
    Alarm(ThreadSettings thread, Handler handler);
    ~Alarm();
    Alarm(const Alarm&) = delete;
    Alarm& operator=(const Alarm&) = delete;

    /// Replaces the instant set before, if the alarm has not expired.
    void set(std::size_t alarm, Time due) noexcept;
    void clear(std::size_t alarm) noexcept { due_ns_[alarm].store(never_ns, std::memory_order_release); }
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }

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
