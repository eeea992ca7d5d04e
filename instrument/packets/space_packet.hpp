// SPDX-License-Identifier: Apache-2.0
// CCSDS space packets (133.0-B-2): primary header, and TAI as unsegmented time code (301.0-B-4).
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

namespace obscura::instrument {

constexpr std::size_t primary_header_bytes = 6;
constexpr unsigned sequence_modulus = 1U << 14;
constexpr unsigned apid_modulus = 1U << 11;
/// Data field of a packet of this program, secondary header included.
constexpr std::size_t max_packet_bytes = 512;

/// What the primary header tells.
struct PacketHeader {
    bool command = false;
    bool secondary_header = true;
    std::uint16_t apid = 0;
    std::uint16_t sequence = 0; ///< modulo sequence_modulus

    constexpr bool operator==(const PacketHeader&) const = default;
};

/// Time since 1958-01-01 TAI in seconds and 2^-24 s: CUC of level 1 with 4 and 3 octets.
struct TimeCode {
    std::uint32_t seconds = 0, fraction = 0;
};
/// P-field of that time code: epoch 1958, 4 octets of seconds, 3 of fraction.
constexpr std::uint8_t time_code_field = 0b0001'1111;
/// `tai_ns`: since 1970-01-01 TAI; not before 1958. The fraction is cut, not rounded.
[[nodiscard]] TimeCode time_code(std::int64_t tai_ns) noexcept;

/// Appends numbers in network byte order.
class ByteWriter {
public:
    void number(std::uint64_t value, std::size_t bytes);
    [[nodiscard]] std::vector<std::uint8_t>& bytes() noexcept { return bytes_; }

private:
    std::vector<std::uint8_t> bytes_;
};

/// Reads a number of that many bytes in network byte order.
[[nodiscard]] std::uint64_t number_at(std::span<const std::uint8_t> bytes, std::size_t offset,
                                      std::size_t count) noexcept;

/// A whole packet: `data` is the data field, of 1 to 65536 bytes.
[[nodiscard]] std::vector<std::uint8_t> make_packet(const PacketHeader& header,
                                                    std::span<const std::uint8_t> data);
/// The header of a packet of version 1 that is not segmented and as long as it says; else nullopt.
[[nodiscard]] std::optional<PacketHeader> read_header(std::span<const std::uint8_t> packet) noexcept;

} // namespace obscura::instrument
