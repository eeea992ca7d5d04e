// A worker's sign of life, looked at by whoever feeds the watchdog.
#pragma once

#include "core/time.hpp"

#include <atomic>
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

namespace obscura {

/// Beaten by one thread, wherever that thread may wait, at least every longest_wait_ns; read by another. A
/// thread about to make a call that may lawfully take longer (a device that answers slowly, a disk) says so
/// first. Neither allocates, locks nor waits.
class Heartbeat {
public:
    /// How long a supervised thread waits for anything before it beats again.
    static constexpr std::int64_t longest_wait_ns = 250 * ns_per_ms;

    explicit Heartbeat(std::string name) : name_(std::move(name)) {}
    [[nodiscard]] const std::string& name() const noexcept { return name_; }

    /// Worker: alive, and to be heard from again soon.
    void beat() noexcept {
        silent_until_ns_.store(0, std::memory_order_relaxed);
        beats_.fetch_add(1, std::memory_order_relaxed);
    }
    /// Worker: will not be heard of before `t` (CLOCK_MONOTONIC), and that is all right.
    void allow_silence_until(Time t) noexcept {
        beats_.fetch_add(1, std::memory_order_relaxed);
        silent_until_ns_.store(t.ns, std::memory_order_relaxed);
    }
    /// Owner: a thread that has ended, or not yet begun, owes no beats. A new one starts with the next
    /// beat().
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
