// Tells the service manager how the daemon is: sd_notify(3) without libsystemd.
#pragma once

#include <cstdint>
#include <string_view>

namespace obscura::emulator {

/// Sends `state` ("READY=1" and so on) to the socket named in NOTIFY_SOCKET, a path or an abstract name with
/// a leading '@'. False when there is none or it cannot be reached; that is never an error of the daemon.
bool notify_service_manager(std::string_view state) noexcept;

/// Nanoseconds within which the service manager wants to hear from this process again; 0: it does not.
[[nodiscard]] std::int64_t watchdog_interval_ns() noexcept;

} // namespace obscura::emulator
