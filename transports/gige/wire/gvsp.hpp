// SPDX-License-Identifier: Apache-2.0
// The packets of the stream protocol (GVSP): sizes, codes and header writers.
#pragma once

#include "core/camera/frame.hpp"
#include "transports/gige/wire/gvcp.hpp"
#include "transports/gige/wire/payload_part.hpp"

#include <cstdint>
#include <span>

namespace obscura::transports::gige {

constexpr std::size_t ip_udp_bytes = 28;
constexpr std::size_t gvsp_header_bytes = 8;           ///< 16-bit block ids
constexpr std::size_t gvsp_extended_header_bytes = 20; ///< 64-bit block ids
constexpr std::size_t gvsp_part_header_bytes = 8;      ///< in front of multi-part payload
constexpr std::size_t gvsp_part_info_bytes = 48;       ///< per part in a multi-part leader
constexpr std::size_t gvsp_max_leader = 12 + max_parts * gvsp_part_info_bytes;
constexpr std::size_t gvsp_max_trailer = 32;

enum class PacketFormat : std::uint8_t { leader = 1, trailer = 2, payload = 3, multipart = 7 };

enum class PayloadType : std::uint16_t {
    image = 0x0001,
    extended_chunk = 0x0005, ///< image and chunks, GigE Vision 1
    multipart = 0x000A,
    image_with_chunks = 0x4001, ///< GigE Vision 2
};

/// Flags of extended headers.
namespace gvsp_flag {
constexpr std::uint16_t resent = 0x0001;
constexpr std::uint16_t previous_block_dropped = 0x0002; ///< a frame before this one was made but never sent
constexpr std::uint16_t resend_range_error = 0x0004;     ///< the block has no such packet
} // namespace gvsp_flag

/// Id on the wire of the `count`-th block of a stream, counted from 1; never 0.
constexpr std::uint64_t wire_block_id(std::uint64_t count, bool extended) noexcept {
    return extended ? count : (count - 1) % 0xFFFF + 1;
}

/// Writes the GVSP header and returns its length. A resent packet is marked by status 0x0100 in standard mode
/// and by a flag in extended mode, where clients discard a status other than 0. Other flags exist there only.
std::size_t write_gvsp_header(std::uint8_t* out, bool extended, Status status, std::uint64_t block_id,
                              PacketFormat format, std::uint32_t packet_id, bool resent,
                              std::uint16_t flags = 0) noexcept;

/// Leader of an image with or without chunks, without GVSP header; returns its length. `timestamp_ns` is
/// device time.
std::size_t write_image_leader(std::uint8_t* out, PayloadType type, PixelFormat format, const Region& image,
                               std::uint64_t timestamp_ns) noexcept;
/// `payload_bytes` is the whole length of the payload when it is made of chunks.
std::size_t write_image_trailer(std::uint8_t* out, PayloadType type, std::int32_t rows,
                                std::size_t payload_bytes, std::uint32_t layout_id) noexcept;
/// Leader of a multi-part payload: a table of its parts. The number of parts goes into the GVSP header, see
/// set_part_count().
std::size_t write_multipart_leader(std::uint8_t* out, const FrameInfo& info,
                                   std::span<const PayloadPart> parts, std::uint64_t timestamp_ns) noexcept;
std::size_t write_multipart_trailer(std::uint8_t* out) noexcept;
/// Sets the number of parts in an extended GVSP header that has been written.
void set_part_count(std::uint8_t* header, std::size_t parts) noexcept;
/// Header of the data in a multi-part payload packet; `offset` counts from the start of the whole payload, as
/// Aravis reads it.
std::size_t write_part_header(std::uint8_t* out, std::uint8_t part, std::uint64_t offset, bool last) noexcept;

} // namespace obscura::transports::gige
