// SPDX-License-Identifier: Apache-2.0
// The loopback interface as a GigE Vision transport sees it, for senders that are tested alone.
#pragma once

#include "transports/gige/channels/network_interface.hpp"

#include <netinet/in.h>

namespace obscura::test {

inline transports::gige::NetworkInterface loopback_interface() {
    transports::gige::NetworkInterface n;
    n.name = "lo";
    n.address = INADDR_LOOPBACK;
    n.mask = 0xFF000000;
    n.loopback = true;
    return n;
}

} // namespace obscura::test
