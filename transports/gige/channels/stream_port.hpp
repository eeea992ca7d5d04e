// SPDX-License-Identifier: Apache-2.0
// Interface between the control side of the camera and its stream sender.
#pragma once

#include "core/time.hpp"
#include "transports/gige/channels/fault_injector.hpp"
#include "transports/gige/channels/payload.hpp"
#include "transports/gige/wire/gvcp_parser.hpp"

#include <cstdint>

namespace obscura::transports::gige {

/// Parameters of the sender for one acquisition, constant while it lasts.
struct StreamConfig {
    std::uint32_t destination_ip = 0; ///< host byte order
    std::uint16_t destination_port = 0;
    std::uint32_t packet_size = 1500; ///< IP datagram: headers for IP, UDP and GVSP included
    bool do_not_fragment = false;
    bool extended_ids = false;
    std::int64_t packet_delay_ns = 0;   ///< gap after each packet (GevSCPD)
    std::uint32_t throughput_limit = 0; ///< bytes per second on the wire; 0: none
    /// Block ids continue those of the previous stream instead of starting at 1.
    bool continue_blocks = false;
    /// Chunks extend the image payload type instead of using the chunk payload type.
    bool chunk_in_image = false;
    StatusCodes status_codes; ///< enabled for answers to resend requests
    PayloadFormat payload;
    FaultInjector faults;
};

/// Stream sender as the control side uses it; GvspSender implements it. Thread-bound: control thread.
class StreamPort {
public:
    virtual ~StreamPort() = default;
    /// Opens a stream: waits for the current block to end and discards earlier blocks. Allocates. Returns
    /// false when the sender does not become idle.
    virtual bool begin(const StreamConfig& config) = 0;
    /// Accepts no further frame and abandons the current block. The last blocks stay in memory for resends.
    virtual void abort() noexcept = 0;
    /// Whether the sender has become idle after abort().
    [[nodiscard]] virtual bool idle() const noexcept = 0;
    /// Waits for idle(); false when it takes longer than `span_ns`.
    virtual bool wait_idle(std::int64_t span_ns) noexcept = 0;
    /// Replaces the fault rules of the stream from its next frame on. Allocates.
    virtual void set_faults(FaultInjector /*faults*/) {}
    virtual void resend(const ResendRequest& request) noexcept = 0;
    /// Sends one GVSP test packet of exactly `config.packet_size` bytes.
    virtual bool send_test_packet(const StreamConfig& config) noexcept = 0;
    [[nodiscard]] virtual std::uint16_t source_port() const noexcept = 0;
};

} // namespace obscura::transports::gige
