// SPDX-License-Identifier: Apache-2.0
// Event count: waiters with deadlines, many notifiers, lock-free.
#pragma once

#include "core/time.hpp"

#include <atomic>
#include <cstdint>

namespace obscura {

/// Usage on a waiting thread: read `seen = events.value()`, check for work, and only if there is none call
/// `events.wait(seen, deadline)`; a notification in between makes the wait return at once.
/// Thread-safe and real-time safe; notify() wakes all waiting threads, and makes a system call only while a
/// thread waits.
class EventCount {
public:
    static constexpr Time never{INT64_MAX};

    [[nodiscard]] std::uint32_t value() const noexcept { return count_.load(std::memory_order_acquire); }
    void notify() noexcept;
    /// Returns when value() is no longer `seen`, or at `deadline` (CLOCK_MONOTONIC), or spuriously.
    void wait(std::uint32_t seen, Time deadline = never) noexcept;

private:
    std::atomic<std::uint32_t> count_{0};
    std::atomic<std::uint32_t> waiting_{0};
};

} // namespace obscura
