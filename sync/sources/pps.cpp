// SPDX-License-Identifier: Apache-2.0
#include "sync/sources/pps.hpp"

#include "sync/inputs/pps_input.hpp"
#include "sync/inputs/pps_trigger.hpp"
#include "sync/settings.hpp"

namespace obscura::sync {

std::unique_ptr<TriggerSource> PpsKind::make(const TriggerLineSettings& line, const Clock& /*clock*/,
                                             const ThreadSettings& thread) const {
    PpsSettings settings;
    settings.rate = line.rate();
    settings.phase_ns = line.phase_ns();
    const auto open = [table = line.table(), device = line.device_node()] { return open_pps(table, device); };
    return std::make_unique<PpsTrigger>(settings, thread, open, std::make_unique<MonotonicClock>());
}

} // namespace obscura::sync
