// SPDX-License-Identifier: Apache-2.0
// Service state notification and watchdog interval of systemd: sd_notify(3) without libsystemd.
#pragma once

#include <cstdint>
#include <string_view>

namespace obscura::host {

/// Sends `state` ("READY=1" and so on) to the socket named in NOTIFY_SOCKET, a path or an abstract name with
/// a leading '@'. Returns false if there is none or it cannot be reached, which is no error of the daemon.
bool notify_service_manager(std::string_view state) noexcept;

/// Watchdog interval of the service manager in nanoseconds; 0: no watchdog for this process.
[[nodiscard]] std::int64_t watchdog_interval_ns() noexcept;

} // namespace obscura::host
