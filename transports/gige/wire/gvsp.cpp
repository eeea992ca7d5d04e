// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/wire/gvsp.hpp"

#include "transports/gige/wire/bytes.hpp"

#include <cstring>

namespace obscura::transports::gige {

std::size_t write_gvsp_header(std::uint8_t* out, bool extended, Status status, std::uint64_t block_id,
                              PacketFormat format, std::uint32_t packet_id, bool resent,
                              std::uint16_t flags) noexcept {
    const auto code = static_cast<std::uint32_t>(format) << 24;
    if (!extended) {
        const Status marked = resent && status == Status::success ? Status::packet_resend : status;
        store_be16(out, static_cast<std::uint16_t>(marked));
        store_be16(out + 2, static_cast<std::uint16_t>(block_id));
        store_be32(out + 4, code | (packet_id & 0x00FFFFFF));
        return gvsp_header_bytes;
    }
    store_be16(out, static_cast<std::uint16_t>(status));
    store_be16(out + 2, static_cast<std::uint16_t>(flags | (resent ? gvsp_flag::resent : 0)));
    store_be32(out + 4, 0x80000000 | code);
    store_be64(out + 8, block_id);
    store_be32(out + 16, packet_id);
    return gvsp_extended_header_bytes;
}

std::size_t write_image_leader(std::uint8_t* out, PayloadType type, PixelFormat format, const Region& image,
                               std::uint64_t timestamp_ns) noexcept {
    store_be16(out, 0);
    store_be16(out + 2, static_cast<std::uint16_t>(type));
    store_be64(out + 4, timestamp_ns);
    store_be32(out + 12, static_cast<std::uint32_t>(format));
    store_be32(out + 16, static_cast<std::uint32_t>(image.width));
    store_be32(out + 20, static_cast<std::uint32_t>(image.height));
    store_be32(out + 24, static_cast<std::uint32_t>(image.x));
    store_be32(out + 28, static_cast<std::uint32_t>(image.y));
    store_be32(out + 32, 0); // no padding after rows or image
    return 36;
}

std::size_t write_image_trailer(std::uint8_t* out, PayloadType type, std::int32_t rows,
                                std::size_t payload_bytes, std::uint32_t layout_id) noexcept {
    store_be16(out, 0);
    store_be16(out + 2, static_cast<std::uint16_t>(type));
    switch (type) {
    case PayloadType::extended_chunk:
        store_be32(out + 4, static_cast<std::uint32_t>(payload_bytes));
        store_be32(out + 8, static_cast<std::uint32_t>(rows));
        store_be32(out + 12, layout_id);
        return 16;
    case PayloadType::image_with_chunks:
        store_be32(out + 4, static_cast<std::uint32_t>(rows));
        store_be32(out + 8, static_cast<std::uint32_t>(payload_bytes));
        store_be32(out + 12, layout_id);
        return 16;
    default:
        store_be32(out + 4, static_cast<std::uint32_t>(rows));
        return 8;
    }
}

std::size_t write_multipart_leader(std::uint8_t* out, const FrameInfo& info,
                                   std::span<const PayloadPart> parts, std::uint64_t timestamp_ns) noexcept {
    constexpr std::uint16_t image_2d = 0x0001, chunk_data = 0x000A, component_intensity = 1;
    store_be16(out, 0);
    store_be16(out + 2, static_cast<std::uint16_t>(PayloadType::multipart));
    store_be64(out + 4, timestamp_ns);
    std::uint8_t* p = out + 12;
    std::uint16_t region = 0;
    for (const PayloadPart& part : parts) {
        std::memset(p, 0, gvsp_part_info_bytes);
        const bool image = part.window != max_windows;
        store_be16(p, image ? image_2d : chunk_data);
        store_be16(p + 2, static_cast<std::uint16_t>(static_cast<std::uint64_t>(part.bytes) >> 32));
        store_be32(p + 4, static_cast<std::uint32_t>(part.bytes));
        if (image) {
            const Region& r = info.windows[part.window].sensor;
            store_be32(p + 8, static_cast<std::uint32_t>(info.pixel_format));
            store_be16(p + 20, component_intensity); // data purpose
            store_be16(p + 22, region++);
            store_be32(p + 24, static_cast<std::uint32_t>(r.width));
            store_be32(p + 28, static_cast<std::uint32_t>(r.height));
            store_be32(p + 32, static_cast<std::uint32_t>(r.x));
            store_be32(p + 36, static_cast<std::uint32_t>(r.y));
        }
        p += gvsp_part_info_bytes;
    }
    return static_cast<std::size_t>(p - out);
}

std::size_t write_multipart_trailer(std::uint8_t* out) noexcept {
    store_be16(out, 0);
    store_be16(out + 2, static_cast<std::uint16_t>(PayloadType::multipart));
    return 4;
}

void set_part_count(std::uint8_t* header, std::size_t parts) noexcept {
    header[7] = static_cast<std::uint8_t>(parts);
}

std::size_t write_part_header(std::uint8_t* out, std::uint8_t part, std::uint64_t offset,
                              bool last) noexcept {
    constexpr std::uint8_t end_of_part_and_zone = 0x41;
    out[0] = part;
    out[1] = last ? end_of_part_and_zone : 0;
    store_be16(out + 2, static_cast<std::uint16_t>(offset >> 32));
    store_be32(out + 4, static_cast<std::uint32_t>(offset));
    return gvsp_part_header_bytes;
}

} // namespace obscura::transports::gige
