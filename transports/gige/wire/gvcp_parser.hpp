// SPDX-License-Identifier: Apache-2.0
// Parser of GVCP requests: one datagram to a checked request. A pure function, safe for any input.
#pragma once

#include "transports/gige/wire/gvcp.hpp"

#include <cstdint>
#include <span>

namespace obscura::transports::gige {

/// PACKETRESEND: packets of one block that a receiver misses.
struct ResendRequest {
    std::uint16_t channel = 0;
    std::uint64_t block_id = 0;
    /// Packet ids, inclusive; `last` is all ones for the rest of the block.
    std::uint32_t first = 0, last = 0;
    bool extended = false; ///< the request has 64-bit ids
    /// Sent from the socket that receives the stream or from the controller's socket, not only from the host
    /// of one.
    bool trusted = true;
};

struct ActionRequest {
    std::uint32_t device_key = 0, group_key = 0, group_mask = 0;
    bool scheduled = false;
    std::uint64_t instant_ns = 0; ///< device time stamp; scheduled only
};

struct ForceIpRequest {
    std::uint64_t mac = 0;
    std::uint32_t ip = 0, mask = 0, gateway = 0;
};

/// Request of one datagram.
struct Request {
    enum class Kind : std::uint8_t {
        ignore, ///< send no answer
        reject, ///< acknowledge with `status`
        run,    ///< well formed; execute it
    };
    Kind kind = Kind::ignore;
    Status status = Status::success;
    Command command{};
    std::uint16_t id = 0;
    std::uint8_t flags = 0;
    std::span<const std::uint8_t> payload; ///< inside the datagram
    std::uint32_t address = 0;             ///< READMEM, WRITEMEM
    std::uint16_t count = 0;               ///< READMEM: bytes; READREG, WRITEREG: entries
    ResendRequest resend;
    ActionRequest action;
    ForceIpRequest force_ip;

    [[nodiscard]] bool wants_ack() const noexcept { return (flags & gvcp_flag::ack_required) != 0; }
};

/// `broadcast`: the datagram was sent to a broadcast address; then only DISCOVERY, FORCEIP and ACTION are
/// accepted. By the rules of GVCP a datagram without a valid header is ignored, and one with a valid header
/// and invalid contents is rejected.
[[nodiscard]] Request parse_gvcp(std::span<const std::uint8_t> datagram, bool broadcast) noexcept;

} // namespace obscura::transports::gige
