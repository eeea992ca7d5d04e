// Whether every worker of the daemon still lives: what the watchdog is fed by.
#pragma once

#include "core/heartbeat.hpp"

#include <cstdint>
#include <map>
#include <string>

namespace obscura::emulator {

/// Remembers between two feedings who has been heard of. One thread.
class Supervisor {
public:
    /// True when every thread of `workers` has beaten since the last time that this returned true, or is
    /// excused at `now` (CLOCK_MONOTONIC), and `pipeline_moves` was true in one of the calls since then. A
    /// thread that is not in `workers` any more is forgotten.
    [[nodiscard]] bool all_alive(const Heartbeats& workers, bool pipeline_moves, Time now);
    /// Who was missed in the last call, for the log; empty: nobody.
    [[nodiscard]] const std::string& missed() const noexcept { return missed_; }

private:
    std::map<const Heartbeat*, std::uint64_t> beats_; ///< at the last feeding
    bool pipeline_moved_ = false;
    std::string missed_;
};

} // namespace obscura::emulator
