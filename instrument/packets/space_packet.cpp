// SPDX-License-Identifier: Apache-2.0
#include "instrument/packets/space_packet.hpp"

#include "core/time.hpp"

namespace obscura::instrument {
namespace {

constexpr unsigned unsegmented = 3;
/// 4383 days: 1958 to 1970 has three leap years.
constexpr std::int64_t epoch_1970_s = 4383LL * 86400;

} // namespace

TimeCode time_code(std::int64_t tai_ns) noexcept {
    std::int64_t seconds = tai_ns / ns_per_s, rest = tai_ns % ns_per_s;
    if (rest < 0) {
        --seconds;
        rest += ns_per_s;
    }
    const std::uint64_t fraction = (static_cast<std::uint64_t>(rest) << 24U) / ns_per_s;
    return {static_cast<std::uint32_t>(seconds + epoch_1970_s), static_cast<std::uint32_t>(fraction)};
}

void ByteWriter::number(std::uint64_t value, std::size_t bytes) {
    for (std::size_t i = bytes; i-- > 0;)
        bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * i)));
}

std::uint64_t number_at(std::span<const std::uint8_t> bytes, std::size_t offset, std::size_t count) noexcept {
    std::uint64_t value = 0;
    for (const std::uint8_t byte : bytes.subspan(offset, count))
        value = value << 8U | byte;
    return value;
}

std::vector<std::uint8_t> make_packet(const PacketHeader& header, std::span<const std::uint8_t> data) {
    ByteWriter out;
    out.number((header.command ? 1U << 12 : 0U) | (header.secondary_header ? 1U << 11 : 0U) |
                   header.apid % apid_modulus,
               2);
    out.number(unsegmented << 14U | header.sequence % sequence_modulus, 2);
    out.number(data.size() - 1, 2);
    out.bytes().insert(out.bytes().end(), data.begin(), data.end());
    return std::move(out.bytes());
}

std::optional<PacketHeader> read_header(std::span<const std::uint8_t> packet) noexcept {
    if (packet.size() <= primary_header_bytes) return std::nullopt;
    const std::uint64_t identification = number_at(packet, 0, 2), control = number_at(packet, 2, 2);
    if (identification >> 13U != 0 || control >> 14U != unsegmented) return std::nullopt;
    if (number_at(packet, 4, 2) + 1 != packet.size() - primary_header_bytes) return std::nullopt;
    return PacketHeader{(identification >> 12U & 1U) != 0, (identification >> 11U & 1U) != 0,
                        static_cast<std::uint16_t>(identification % apid_modulus),
                        static_cast<std::uint16_t>(control % sequence_modulus)};
}

} // namespace obscura::instrument
