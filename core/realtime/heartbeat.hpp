// SPDX-License-Identifier: Apache-2.0
// Watchdog heartbeat of one supervised thread; polled by the supervisor.
#pragma once

#include "core/time.hpp"

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace obscura {

/// Written by the supervised thread at every place where it may wait, at least every max_wait_ns; read by
/// the supervisor's thread. Before a call that may legitimately take longer (a slow device, a disk) the
/// supervised thread announces it. Both sides are real-time safe.
class Heartbeat {
public:
    /// Longest wait of a supervised thread between two beats.
    static constexpr std::int64_t max_wait_ns = 250 * ns_per_ms;

    explicit Heartbeat(std::string name) : name_(std::move(name)) {}
    [[nodiscard]] const std::string& name() const noexcept { return name_; }

    /// Supervised thread: reports progress; the next beat follows within max_wait_ns.
    void beat() noexcept {
        silent_until_ns_.store(0, std::memory_order_relaxed);
        beats_.fetch_add(1, std::memory_order_relaxed);
    }
    /// Supervised thread: announces a blocking call; no beat is expected before `t` (CLOCK_MONOTONIC).
    void allow_silence_until(Time t) noexcept {
        beats_.fetch_add(1, std::memory_order_relaxed);
        silent_until_ns_.store(t.ns, std::memory_order_relaxed);
    }
    /// Owner: suspends supervision, because the thread has ended or not begun. The next beat() resumes it.
    void rest() noexcept { silent_until_ns_.store(INT64_MAX, std::memory_order_relaxed); }

    [[nodiscard]] std::uint64_t beats() const noexcept { return beats_.load(std::memory_order_relaxed); }
    [[nodiscard]] bool may_be_silent(Time now) const noexcept {
        return now.ns < silent_until_ns_.load(std::memory_order_relaxed);
    }

private:
    const std::string name_;
    std::atomic<std::uint64_t> beats_{0};
    std::atomic<std::int64_t> silent_until_ns_{INT64_MAX};
};

using Heartbeats = std::vector<const Heartbeat*>;

} // namespace obscura
