// SPDX-License-Identifier: Apache-2.0
// Stream channel of the device: configuration of the stream, start and stop of the acquisition.
#pragma once

#include "transports/gige/device/device_context.hpp"

#include <cstdint>

namespace obscura::transports::gige {

/// GevSCPSPacketSize: the IP datagram that every host must accept, and the largest offered.
constexpr std::uint32_t packet_size_min = 576;
constexpr std::uint32_t packet_size_limit = 16'384;

/// GevSCCFGMultiPart.
[[nodiscard]] bool multipart(const DeviceContext& d);
/// Bits of the chunks that are sent, see chunk_bit().
[[nodiscard]] std::uint32_t chunk_selection(const DeviceContext& d);
[[nodiscard]] StreamConfig stream_config(const DeviceContext& d);
/// Status codes that answers may have.
[[nodiscard]] StatusCodes status_codes(const DeviceContext& d);

Status acquisition_start(DeviceContext& d);
Status acquisition_stop(DeviceContext& d);

/// Whether packets may be sent to `ip`. The check keeps a controller from flooding arbitrary hosts.
[[nodiscard]] Status check_destination(const DeviceContext& d, std::uint32_t ip);
[[nodiscard]] constexpr bool is_multicast(std::uint32_t ip) {
    return ip >> 28 == 0xE;
}
Status write_stream_port(DeviceContext& d, std::uint32_t value);
Status write_packet_size(DeviceContext& d, std::uint32_t value);

} // namespace obscura::transports::gige
