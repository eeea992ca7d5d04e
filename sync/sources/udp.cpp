// SPDX-License-Identifier: Apache-2.0
#include "sync/sources/udp.hpp"

#include "sync/edge_trigger.hpp"
#include "sync/settings.hpp"
#include "sync/udp_input.hpp"

#include <stdexcept>

namespace obscura::sync {

config::Keys UdpKind::keys() {
    return {config::key("listen", &listen).help("udp: IPv4 address and port that triggers are sent to")};
}

void UdpKind::check(const TriggerLineSettings& /*line*/, const Refuse& refuse) const {
    try {
        (void)parse_udp_address(listen);
    } catch (const std::invalid_argument& error) {
        refuse("listen", error.what());
    }
}

std::unique_ptr<TriggerSource> UdpKind::make(const TriggerLineSettings& line, const Clock& clock,
                                             const ThreadSettings& thread) const {
    const auto open = [table = line.table(), address = listen] { return open_udp(table, address); };
    return std::make_unique<EdgeTrigger>(edge_trigger_settings(line, thread), open, clock);
}

} // namespace obscura::sync
