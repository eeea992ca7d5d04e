// The packets of the stream protocol (GVSP): sizes, codes and header writers.
#pragma once

#include "core/frame.hpp"
#include "transports/gige/gvcp.hpp"

#include <cstdint>
#include <span>

namespace obscura::transports::gige {

constexpr std::size_t ip_udp_bytes = 28;
constexpr std::size_t gvsp_header_bytes = 8;           ///< 16-bit block ids
constexpr std::size_t gvsp_extended_header_bytes = 20; ///< 64-bit block ids
constexpr std::size_t gvsp_max_leader = 64;
constexpr std::size_t gvsp_max_trailer = 32;

enum class PacketFormat : std::uint8_t { leader = 1, trailer = 2, payload = 3 };

constexpr std::uint16_t payload_type_image = 0x0001;

/// The id of the `count`-th block of a stream (from 1) as it goes on the wire; never 0.
constexpr std::uint64_t wire_block_id(std::uint64_t count, bool extended) noexcept {
    return extended ? count : (count - 1) % 0xFFFF + 1;
}

/// Writes the GVSP header and returns its length. A resent packet is marked by status 0x0100 in standard mode
/// and by a flag in extended mode, where clients discard a status other than 0.
std::size_t write_gvsp_header(std::uint8_t* out, bool extended, Status status, std::uint64_t block_id,
                              PacketFormat format, std::uint32_t packet_id, bool resent) noexcept;

/// Leader of an image, without GVSP header; returns its length. `timestamp_ns` is device time.
std::size_t write_image_leader(std::uint8_t* out, const FrameInfo& info, std::uint64_t timestamp_ns) noexcept;
std::size_t write_image_trailer(std::uint8_t* out, std::int32_t rows) noexcept;

} // namespace obscura::transports::gige
