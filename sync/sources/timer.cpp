// SPDX-License-Identifier: Apache-2.0
#include "sync/sources/timer.hpp"

#include "sync/settings.hpp"
#include "sync/timer.hpp"

namespace obscura::sync {

std::unique_ptr<TriggerSource> TimerKind::make(const TriggerLineSettings& line, const Clock& /*clock*/,
                                               const ThreadSettings& thread) const {
    TimerSettings settings;
    settings.rate = line.rate();
    settings.phase_ns = line.phase_ns();
    settings.thread = thread;
    return std::make_unique<TimerTrigger>(settings, std::make_unique<MonotonicClock>());
}

} // namespace obscura::sync
