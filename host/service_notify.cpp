// SPDX-License-Identifier: Apache-2.0
#include "host/service_notify.hpp"

#include "core/time.hpp"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace obscura::host {

bool notify_service_manager(std::string_view state) noexcept {
    const char* name = std::getenv("NOTIFY_SOCKET");
    sockaddr_un address{};
    const std::size_t length = name != nullptr ? std::strlen(name) : 0;
    if (length < 2 || length >= sizeof address.sun_path || (name[0] != '/' && name[0] != '@')) return false;
    address.sun_family = AF_UNIX;
    std::memcpy(address.sun_path, name, length);
    // An abstract name starts with a zero byte and ends with the length of the address.
    if (name[0] == '@') address.sun_path[0] = '\0';
    const auto size = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + length);

    const int fd = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    if (fd < 0) return false;
    const ssize_t sent = ::sendto(fd, state.data(), state.size(), MSG_NOSIGNAL | MSG_DONTWAIT,
                                  reinterpret_cast<const sockaddr*>(&address), size);
    ::close(fd);
    return sent == static_cast<ssize_t>(state.size());
}

std::int64_t watchdog_interval_ns() noexcept {
    const char* microseconds = std::getenv("WATCHDOG_USEC");
    if (microseconds == nullptr) return 0;
    // WATCHDOG_PID, if set, names the process that the watchdog applies to.
    const char* pid = std::getenv("WATCHDOG_PID");
    if (pid != nullptr && std::strtoll(pid, nullptr, 10) != ::getpid()) return 0;
    const long long value = std::strtoll(microseconds, nullptr, 10);
    return value > 0 && value < 86'400'000'000LL ? value * ns_per_us : 0;
}

} // namespace obscura::host
