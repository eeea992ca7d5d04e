// A thread that calls back at instants set by other threads.
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

/// A few alarms, each with one instant at most. set() and clear() from any thread, real-time ones included.
class Alarm {
public:
    static constexpr std::size_t alarm_count = 8;
    using Ring = std::function<void(std::size_t alarm, Time due)>;

    /// `ring` is called on the thread of this object, which is real-time: it must not block, allocate, lock
    /// or throw. It may set alarms.
    Alarm(ThreadSettings thread, Ring ring);
    ~Alarm();
    Alarm(const Alarm&) = delete;
    Alarm& operator=(const Alarm&) = delete;

    /// Replaces the instant set before, if that has not come.
    void set(std::size_t alarm, Time due) noexcept;
    void clear(std::size_t alarm) noexcept { due_ns_[alarm].store(never_ns, std::memory_order_release); }
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }

private:
    static constexpr std::int64_t never_ns = INT64_MAX;
    void run() noexcept;

    const Ring ring_;
    MonotonicClock clock_;
    std::array<std::atomic<std::int64_t>, alarm_count> due_ns_{};
    std::atomic<bool> stopping_{false};
    EventCount bell_;
    Heartbeat heartbeat_{"alarm"};
    std::thread thread_;
};

} // namespace obscura::emulator
