// SPDX-License-Identifier: Apache-2.0
// The seam between the control side of the camera and its stream sender.
#pragma once

#include "core/time.hpp"
#include "transports/gige/channels/fault_injector.hpp"
#include "transports/gige/channels/payload.hpp"
#include "transports/gige/wire/gvcp_parser.hpp"

#include <cstdint>

namespace obscura::transports::gige {

/// Everything the sender needs to know for one acquisition. Fixed while it lasts.
struct StreamConfig {
    std::uint32_t destination_ip = 0; ///< host byte order
    std::uint16_t destination_port = 0;
    std::uint32_t packet_size = 1500; ///< IP datagram: headers for IP, UDP and GVSP included
    bool do_not_fragment = false;
    bool extended_ids = false;
    std::int64_t packet_delay_ns = 0;   ///< gap after each packet (GevSCPD)
    std::uint32_t throughput_limit = 0; ///< bytes per second on the wire; 0: none
    bool continue_blocks = false;       ///< block ids go on from the stream before instead of from 1
    bool chunk_in_image = false; ///< chunks as an extension of the image payload, not in a type of their own
    StatusCodes status_codes;    ///< that answers to resend requests may have
    PayloadFormat payload;
    FaultInjector faults;
};

/// Implemented by GvspSender; called on the control thread only.
class StreamPort {
public:
    virtual ~StreamPort() = default;
    /// Opens a stream: lets the block in work end, forgets earlier blocks. Allocates.
    /// False when the sender does not come to rest.
    virtual bool begin(const StreamConfig& config) = 0;
    /// Takes no further frame and gives up the block in work. The last blocks stay in memory for resends.
    virtual void abort() noexcept = 0;
    /// Whether, after abort(), the sender has come to rest.
    [[nodiscard]] virtual bool idle() const noexcept = 0;
    /// Waits for idle(); false when it takes longer than `span_ns`.
    virtual bool wait_idle(std::int64_t span_ns) noexcept = 0;
    virtual void resend(const ResendRequest& request) noexcept = 0;
    /// One packet of exactly `config.packet_size` bytes that fills a GVSP test packet.
    virtual bool send_test_packet(const StreamConfig& config) noexcept = 0;
    [[nodiscard]] virtual std::uint16_t source_port() const noexcept = 0;
};

} // namespace obscura::transports::gige
