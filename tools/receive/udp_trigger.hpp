// SPDX-License-Identifier: Apache-2.0
// Sender of trigger datagrams for daemons whose trigger source is "udp".
#pragma once

#include <cstdint>
#include <string>

namespace obscura::tools {

struct UdpTriggers {
    std::string address; ///< HOST:PORT
    double rate_hz = 1;
    std::uint32_t frames = 1; ///< 0: until interrupted
    std::uint32_t first = 1;  ///< number of the first datagram
    bool stamped = false;     ///< each has the instant of its sending by CLOCK_TAI
};

/// Sends them, until interrupted, and returns how many. Throws UsageError for the address, HardwareError if
/// nothing listens there.
std::uint32_t send_triggers(const UdpTriggers& triggers);

} // namespace obscura::tools
