// SPDX-License-Identifier: Apache-2.0
// Edge input for trigger datagrams (UDP), for simulators without a trigger wire.
//
// A datagram is 16 bytes, big endian: the letters "OBTR", a 32-bit sequence number that counts from 1 (0: not
// counted), and the edge's instant in ns of TAI (0: the datagram's arrival, as stamped by the kernel). An
// empty datagram may be an edge too, neither counted nor stamped.
#pragma once

#include "core/clock.hpp"
#include "sync/edge_input.hpp"

#include <netinet/in.h>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <string>

namespace obscura::sync {

struct UdpTriggerMessage {
    std::uint32_t sequence = 0;
    std::int64_t tai_ns = 0;

    constexpr bool operator==(const UdpTriggerMessage&) const = default;
};
constexpr std::size_t udp_trigger_bytes = 16;
/// Datagrams, of triggers or not, that one EdgeInput::wait() takes at most, and how long it rests after so
/// many: a flood leaves the processor to those that make frames.
constexpr int udp_datagrams_per_wait = 64;
constexpr std::int64_t udp_rest_ns = ns_per_ms;

/// Decodes a datagram. Returns false when the bytes are not a trigger message.
[[nodiscard]] bool decode(std::span<const std::uint8_t> bytes, UdpTriggerMessage& message) noexcept;
[[nodiscard]] std::array<std::uint8_t, udp_trigger_bytes> encode(const UdpTriggerMessage& message) noexcept;

/// Parses an address such as "127.0.0.1:5002". Throws std::invalid_argument.
[[nodiscard]] sockaddr_in parse_udp_address(const std::string& text);

/// Which datagrams are triggers.
struct UdpTriggers {
    bool accept_empty = false;    ///< empty ones are
    double max_rate_hz = 1000;    ///< further ones are none, see RateLimit
    const Clock* clock = nullptr; ///< outlives the input; makes instants of TAI, before CLOCK_TAI
};

/// Binds to `address`. Datagrams that are not triggers are dropped and counted, with those for which the
/// kernel had no room. Throws ConfigError for an invalid address, else HardwareError; both name the key
/// `listen` of `table`.
[[nodiscard]] std::unique_ptr<EdgeInput> open_udp(const std::string& table, const std::string& address,
                                                  const UdpTriggers& triggers = {});

} // namespace obscura::sync
