// SPDX-License-Identifier: Apache-2.0
// The receiving end of a camera's message channel.
#pragma once

#include "tests/support/catch.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <optional>

namespace obscura::test {

/// A UDP socket on 127.0.0.1 that takes EVENT commands and acknowledges them.
class EventSocket {
public:
    struct Message {
        std::uint16_t request = 0, id = 0, block = 0;
        std::uint64_t timestamp = 0;
    };

    EventSocket() : fd_(socket(AF_INET, SOCK_DGRAM, 0)) {
        sockaddr_in a{};
        a.sin_family = AF_INET;
        a.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t bytes = sizeof a;
        REQUIRE(bind(fd_, reinterpret_cast<sockaddr*>(&a), sizeof a) == 0);
        REQUIRE(getsockname(fd_, reinterpret_cast<sockaddr*>(&a), &bytes) == 0);
        port_ = ntohs(a.sin_port);
    }
    ~EventSocket() { close(fd_); }
    EventSocket(const EventSocket&) = delete;
    EventSocket& operator=(const EventSocket&) = delete;

    [[nodiscard]] std::uint16_t port() const { return port_; }

    /// The next event; nothing when none comes in time or what comes is no event.
    std::optional<Message> receive(int timeout_ms, bool acknowledge = true) {
        const timeval timeout{timeout_ms / 1000, timeout_ms % 1000 * 1000};
        setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &timeout, sizeof timeout);
        std::uint8_t d[64] = {};
        sockaddr_in from{};
        socklen_t from_bytes = sizeof from;
        if (recvfrom(fd_, d, sizeof d, 0, reinterpret_cast<sockaddr*>(&from), &from_bytes) != 24) return {};
        if (d[0] != 0x42 || d[3] != 0xC0) return {};
        if (acknowledge) {
            const std::uint8_t ack[8] = {0, 0, 0, 0xC1, 0, 0, d[6], d[7]};
            sendto(fd_, ack, sizeof ack, 0, reinterpret_cast<sockaddr*>(&from), from_bytes);
        }
        const auto half = [&](int at) { return static_cast<std::uint16_t>(d[at] << 8 | d[at + 1]); };
        Message m{half(6), half(10), half(14), 0};
        for (int i = 16; i < 24; ++i)
            m.timestamp = m.timestamp << 8 | d[i];
        return m;
    }

private:
    int fd_;
    std::uint16_t port_ = 0;
};

} // namespace obscura::test
