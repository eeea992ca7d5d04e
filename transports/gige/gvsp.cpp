#include "transports/gige/gvsp.hpp"

#include "transports/gige/bytes.hpp"

#include <cstring>

namespace obscura::transports::gige {

std::size_t write_gvsp_header(std::uint8_t* out, bool extended, Status status, std::uint64_t block_id,
                              PacketFormat format, std::uint32_t packet_id, bool resent) noexcept {
    const auto code = static_cast<std::uint32_t>(format) << 24;
    if (!extended) {
        const Status marked = resent && status == Status::success ? Status::packet_resend : status;
        store_be16(out, static_cast<std::uint16_t>(marked));
        store_be16(out + 2, static_cast<std::uint16_t>(block_id));
        store_be32(out + 4, code | (packet_id & 0x00FFFFFF));
        return gvsp_header_bytes;
    }
    store_be16(out, static_cast<std::uint16_t>(status));
    store_be16(out + 2, resent ? 1 : 0);
    store_be32(out + 4, 0x80000000 | code);
    store_be64(out + 8, block_id);
    store_be32(out + 16, packet_id);
    return gvsp_extended_header_bytes;
}

std::size_t write_image_leader(std::uint8_t* out, const FrameInfo& info,
                               std::uint64_t timestamp_ns) noexcept {
    store_be16(out, 0);
    store_be16(out + 2, payload_type_image);
    store_be64(out + 4, timestamp_ns);
    store_be32(out + 12, static_cast<std::uint32_t>(info.pixel_format));
    store_be32(out + 16, static_cast<std::uint32_t>(info.width));
    store_be32(out + 20, static_cast<std::uint32_t>(info.height));
    store_be32(out + 24, static_cast<std::uint32_t>(info.windows[0].sensor.x));
    store_be32(out + 28, static_cast<std::uint32_t>(info.windows[0].sensor.y));
    store_be32(out + 32, 0); // no padding after rows or image
    return 36;
}

std::size_t write_image_trailer(std::uint8_t* out, std::int32_t rows) noexcept {
    store_be16(out, 0);
    store_be16(out + 2, payload_type_image);
    store_be32(out + 4, static_cast<std::uint32_t>(rows));
    return 8;
}

} // namespace obscura::transports::gige
