// Which thread runs where and how urgently, and what of that the machine grants.
#pragma once

#include "core/realtime.hpp"
#include "emulator/config/daemon_config.hpp"

namespace obscura::emulator {

/// Default: ordinary scheduling, any core.
struct ThreadPlan {
    ThreadSettings trigger;  ///< waits for edges
    ThreadSettings pipeline; ///< takes a trigger, plans and renders
    ThreadSettings detector;
    ThreadSettings release;  ///< lets rows out at their times
    ThreadSettings transmit; ///< GigE Vision; its control thread stands one above
    ThreadSettings display;  ///< V4L2 and stimulator
    ThreadSettings render;   ///< the renderer's workers: cores only
};

/// What [threads] asks for. Its texts are good: emulator::load_config() has looked.
[[nodiscard]] ThreadPlan configured_threads(const emulator::DaemonConfig& config);

/// The plan reduced to what is granted, with a line in the log for whatever is not: no priorities where
/// SCHED_FIFO is off or not permitted, no cores that this process may not use. Throws HardwareError where
/// daemon.realtime is "required".
[[nodiscard]] ThreadPlan granted_threads(const emulator::DaemonConfig& config);

/// The highest SCHED_FIFO priority in the plan; 0: none.
[[nodiscard]] int highest_priority(const ThreadPlan& plan) noexcept;

/// Keeps the calling thread on `cores`, if any, as long as it lives; threads made meanwhile stay there.
class PinnedHere {
public:
    explicit PinnedHere(const CoreSet& cores);
    ~PinnedHere();
    PinnedHere(const PinnedHere&) = delete;
    PinnedHere& operator=(const PinnedHere&) = delete;

private:
    CoreSet before_;
};

} // namespace obscura::emulator
