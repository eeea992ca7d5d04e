// SPDX-License-Identifier: Apache-2.0
// Supervision of the daemon's threads by their heartbeats, for the service manager's watchdog.
#pragma once

#include "core/realtime/heartbeat.hpp"

#include <cstdint>
#include <map>
#include <string>

namespace obscura::emulator {

/// Collects heartbeats between two watchdog notifications. Thread-bound.
class Supervisor {
public:
    /// True if every thread of `workers` has beaten since this last returned true, or has announced a
    /// blocking call that lasts at `now` (CLOCK_MONOTONIC), and `pipeline_moves` was true in one of the calls
    /// since then. A thread that has left `workers` is forgotten.
    [[nodiscard]] bool all_alive(const Heartbeats& workers, bool pipeline_moves, Time now);
    /// Thread without a heartbeat in the last call, for the log; empty: none.
    [[nodiscard]] const std::string& missed() const noexcept { return missed_; }

private:
    std::map<const Heartbeat*, std::uint64_t> beats_; ///< counts when all_alive() last returned true
    bool pipeline_moved_ = false;
    std::string missed_;
};

} // namespace obscura::emulator
