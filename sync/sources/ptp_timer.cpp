// SPDX-License-Identifier: Apache-2.0
#include "sync/sources/ptp_timer.hpp"

#include "core/text/printable.hpp"
#include "sync/inputs/ptp_timer.hpp"
#include "sync/settings.hpp"

#include <fmt/format.h>

namespace obscura::sync {

config::Keys PtpTimerKind::keys() {
    return {
        config::key("start", &start)
            .help(
                "ptp_timer: first edge, in seconds of the PTP clock (TAI since 1970), as in \"1795244437.5\"; "
                "empty: its next full second"),
    };
}

void PtpTimerKind::check(const TriggerLineSettings& /*line*/, const Refuse& refuse) const {
    if (!start.empty() && !parse_start(start))
        refuse("start",
               fmt::format("\"{}\": seconds like \"1795244437.5\" are wanted, with up to nine decimals",
                           printable(start)));
}

std::unique_ptr<TriggerSource> PtpTimerKind::make(const TriggerLineSettings& line, const Clock& /*clock*/,
                                                  const ThreadSettings& thread) const {
    PtpTimerSettings settings;
    settings.rate = line.rate();
    settings.phase_ns = line.phase_ns();
    settings.start = parse_start(start); // no value for an empty key
    settings.thread = thread;
    const auto open = [table = line.table(), device = line.device_node()] {
        return open_ptp_clock(table, device);
    };
    return std::make_unique<PtpTimer>(settings, open, std::make_unique<MonotonicClock>());
}

} // namespace obscura::sync
