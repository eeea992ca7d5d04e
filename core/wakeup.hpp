// A bell that one thread waits on and any number of others ring: with a deadline, without locks.
#pragma once

#include "core/time.hpp"

#include <atomic>
#include <cstdint>

namespace obscura {

/// Usage of the waiting thread: `seen = bell.value()`, look at everything that could be work, and only if
/// there is none `bell.wait(seen, deadline)`; a ring in between makes the wait return at once. Neither side
/// allocates, locks or throws; ring() is a system call only when somebody waits.
class Wakeup {
public:
    static constexpr Time never{INT64_MAX};

    [[nodiscard]] std::uint32_t value() const noexcept { return rings_.load(std::memory_order_acquire); }
    void ring() noexcept;
    /// Returns when value() is no longer `seen`, or at `deadline` (CLOCK_MONOTONIC), or now and then for no
    /// reason.
    void wait(std::uint32_t seen, Time deadline = never) noexcept;

private:
    std::atomic<std::uint32_t> rings_{0};
    std::atomic<std::uint32_t> waiting_{0};
};

} // namespace obscura
