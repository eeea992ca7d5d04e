// SPDX-License-Identifier: Apache-2.0
// Verbs `ring` and `watch` of the monitor: frames of a camera for other processes.
#pragma once

#include "emulator/monitor/monitor_verbs.hpp"

#include <functional>
#include <vector>

namespace obscura::transports {
class WatchTransport;
}

namespace obscura::emulator {

/// `cameras`: of each the transport that copies its frames, null where there is none; outlive the verbs.
[[nodiscard]] std::vector<MonitorVerb> frame_verbs(std::vector<transports::WatchTransport*> cameras);

} // namespace obscura::emulator
