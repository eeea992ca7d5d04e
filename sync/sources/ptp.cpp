// SPDX-License-Identifier: Apache-2.0
#include "sync/sources/ptp.hpp"

#include "sync/edge_trigger.hpp"
#include "sync/inputs/ptp_input.hpp"
#include "sync/settings.hpp"

namespace obscura::sync {

config::Keys PtpKind::keys() {
    return {
        config::key("channel", &channel)
            .range(0, 64)
            .help("ptp: channel of the clock's external time stamp inputs"),
    };
}

std::unique_ptr<TriggerSource> PtpKind::make(const TriggerLineSettings& line, const Clock& clock,
                                             const ThreadSettings& thread) const {
    const auto open = [table = line.table(), device = line.device_node(),
                       input = static_cast<unsigned>(channel)] { return open_ptp(table, device, input); };
    return std::make_unique<EdgeTrigger>(edge_trigger_settings(line, thread), open, clock);
}

} // namespace obscura::sync
