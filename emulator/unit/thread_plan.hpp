// SPDX-License-Identifier: Apache-2.0
// Scheduling priorities and core affinities of the daemon's threads, as configured and as granted.
#pragma once

#include "core/realtime/realtime.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/render/render_scheduling.hpp"

namespace obscura::emulator {

/// Default: ordinary scheduling, any core.
struct ThreadPlan {
    ThreadSettings trigger;  ///< trigger sources, which wait for edges
    ThreadSettings pipeline; ///< takes a trigger, plans and renders
    ThreadSettings detector;
    ThreadSettings release;  ///< row release
    ThreadSettings transmit; ///< GigE Vision; its control thread runs one priority above
    ThreadSettings display;  ///< V4L2 and stimulator
    RenderScheduling render; ///< the renderer's workers, and the pipeline thread if that has no priority
    ThreadSettings tiles; ///< makes tiles of terrains: above the renderer's workers if those have a priority
    double tiles_share = 1; ///< of a core that it takes at most while frames are rendered
};

/// Plan as configured in [threads], which emulator::load_config() has checked.
[[nodiscard]] ThreadPlan configured_threads(const emulator::DaemonConfig& config);

/// The plan reduced to what is granted; each reduction is logged. Priorities are dropped if SCHED_FIFO is off
/// or not permitted, the nice level of rendering likewise, cores if this process may not use them. If
/// daemon.realtime is "required", throws HardwareError instead. Rendering without cores gets those of
/// `permitted` that no thread with a priority has been given, if there are any.
[[nodiscard]] ThreadPlan granted_threads(const emulator::DaemonConfig& config,
                                         const CoreSet& permitted = permitted_cores());

/// Cores of `permitted` that no thread with a priority has been given; empty: there are none, or no thread
/// with a priority has cores of its own.
[[nodiscard]] CoreSet ordinary_cores(const ThreadPlan& plan, const CoreSet& permitted = permitted_cores());

/// First call of a thread that works for programs which look at the camera: name, ordinary scheduling with a
/// nice level below that of the daemon's other threads, and cores. Threads that it creates inherit it.
void enter_client_thread(const char* name, const CoreSet& cores) noexcept;

/// The same for a thread that gets what no other thread wants (SCHED_IDLE).
void enter_idle_thread(const char* name, const CoreSet& cores) noexcept;

/// The highest priority in the plan; 0: none.
[[nodiscard]] int highest_priority(const ThreadPlan& plan) noexcept;

/// Gives the process a negative nice level also among the sessions of the machine, if it leads a session of
/// its own, as a service does: Linux shares the processors out among sessions (autogroups) before it looks at
/// threads.
void set_session_nice(int nice);

/// Scope guard that pins the calling thread to `cores`, if any; threads created in the scope inherit it.
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
