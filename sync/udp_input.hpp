// Triggers as UDP datagrams, for simulators that have no wire to the bench.
//
// A datagram is 16 bytes, big endian: the letters "OBTR", a 32-bit sequence number that counts from 1 (0: not
// counted), and the edge's instant in ns of TAI (0: the datagram's arrival, as stamped by the kernel).
#pragma once

#include "sync/edge_input.hpp"

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

/// False when the bytes are no such message.
[[nodiscard]] bool decode(std::span<const std::uint8_t> bytes, UdpTriggerMessage& message) noexcept;
[[nodiscard]] std::array<std::uint8_t, udp_trigger_bytes> encode(const UdpTriggerMessage& message) noexcept;

/// Binds to `address` ("127.0.0.1:5002"). Datagrams that are no trigger are left aside. Throws HardwareError.
[[nodiscard]] std::unique_ptr<EdgeInput> open_udp(const std::string& address);

} // namespace obscura::sync
