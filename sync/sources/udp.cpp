// SPDX-License-Identifier: Apache-2.0
#include "sync/sources/udp.hpp"

#include "sync/edge_trigger.hpp"
#include "sync/inputs/udp_input.hpp"
#include "sync/settings.hpp"

#include <stdexcept>

namespace obscura::sync {

config::Keys UdpKind::keys() {
    return {
        config::key("listen", &listen)
            .help(
                "udp: IPv4 address and port that triggers are sent to. "
                "A trigger is a datagram of 16 bytes, big endian: "
                "\"OBTR\", a 32-bit number that counts from 1 (0: not counted), and the edge's instant in ns of TAI (64 bits; "
                "0: its arrival). obscura trigger sends them"),
        config::key("accept_empty", &accept_empty)
            .help("udp: an empty datagram is a trigger too, at its arrival"),
        config::key("max_rate_hz", &max_rate_hz)
            .range(1, 100'000)
            .help(
                "udp: triggers beyond this rate are refused and counted, but for 8 that may follow each other at once: a "
                "flood of datagrams does not reach the camera"),
    };
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
    const auto open = [table = line.table(), address = listen,
                       triggers = UdpTriggers{accept_empty, max_rate_hz, &clock}] {
        return open_udp(table, address, triggers);
    };
    return std::make_unique<EdgeTrigger>(edge_trigger_settings(line, thread), open, clock);
}

} // namespace obscura::sync
