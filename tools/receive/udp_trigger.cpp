// SPDX-License-Identifier: Apache-2.0
#include "tools/receive/udp_trigger.hpp"

#include "core/error.hpp"
#include "core/io/file_descriptor.hpp"
#include "core/time.hpp"
#include "host/command_line.hpp"
#include "host/interrupt.hpp"
#include "sync/clock_reading.hpp"
#include "sync/inputs/udp_input.hpp"

#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <stdexcept>

namespace obscura::tools {
namespace {

[[noreturn]] void refuse(const UdpTriggers& triggers, int error) {
    throw HardwareError(fmt::format("obscura trigger: {}: {}{}", triggers.address, std::strerror(error),
                                    error == ECONNREFUSED ? ": nothing listens there" : ""));
}

FileDescriptor connect(const UdpTriggers& triggers) {
    sockaddr_in to{};
    try {
        to = sync::parse_udp_address(triggers.address);
    } catch (const std::invalid_argument& error) {
        throw host::UsageError(fmt::format("obscura trigger: --udp: {}", error.what()));
    }
    FileDescriptor socket(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0));
    if (!socket || ::connect(socket.get(), reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0)
        refuse(triggers, errno);
    return socket;
}

void send_trigger(const UdpTriggers& triggers, const FileDescriptor& socket, std::uint32_t number) {
    sync::UdpTriggerMessage message{.sequence = number};
    if (triggers.stamped) {
        timespec now{};
        clock_gettime(CLOCK_TAI, &now);
        message.tai_ns = sync::to_ns(now);
    }
    const auto bytes = sync::encode(message);
    if (::send(socket.get(), bytes.data(), bytes.size(), 0) < 0) refuse(triggers, errno);
}

int pending_error(const FileDescriptor& socket) {
    int error = 0;
    socklen_t size = sizeof error;
    ::getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    return error;
}

} // namespace

std::uint32_t send_triggers(const UdpTriggers& triggers) {
    const FileDescriptor socket = connect(triggers);
    timespec next{};
    clock_gettime(CLOCK_MONOTONIC, &next);
    const std::int64_t begin_ns = sync::to_ns(next);
    std::uint32_t sent = 0;
    for (; (triggers.frames == 0 || sent < triggers.frames) && !host::interrupted(); ++sent) {
        const std::int64_t at_ns =
            begin_ns + static_cast<std::int64_t>(static_cast<double>(sent) / triggers.rate_hz * 1e9);
        next = {at_ns / ns_per_s, at_ns % ns_per_s};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &next, nullptr) == EINTR &&
               !host::interrupted()) {
        }
        if (host::interrupted()) break;
        send_trigger(triggers, socket, triggers.first + sent);
    }
    // The answer that nothing listens comes after the datagram.
    constexpr int timeout_ms = 20;
    pollfd poll{socket.get(), 0, 0};
    if (::poll(&poll, 1, timeout_ms) > 0) refuse(triggers, pending_error(socket));
    return sent;
}

} // namespace obscura::tools
