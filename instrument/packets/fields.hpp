// SPDX-License-Identifier: Apache-2.0
// Rows of the tables of packets: what packers, decoders and all descriptions are made from.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

namespace obscura::instrument {

/// How a field is encoded, in network byte order.
enum class FieldType : std::uint8_t { u8, u16, u24, u32, u64, i64, f32, f64 };

[[nodiscard]] constexpr std::size_t bytes_of(FieldType type) {
    switch (type) {
    case FieldType::u8:
        return 1;
    case FieldType::u16:
        return 2;
    case FieldType::u24:
        return 3;
    case FieldType::u32:
    case FieldType::f32:
        return 4;
    default:
        return 8;
    }
}
[[nodiscard]] constexpr bool is_float(FieldType type) {
    return type == FieldType::f32 || type == FieldType::f64;
}

/// A value and what it is called.
struct FieldState {
    std::uint8_t value;
    std::string_view name; ///< in capitals
};

/// One field of a packet.
struct FieldInfo {
    std::string_view name; ///< in capitals, as ground systems have it
    FieldType type;
    std::string_view unit;
    std::string_view help;
    std::span<const FieldState> states{}; ///< empty: a number
    double least = 0, most = 0;           ///< of an argument of a command that is a number
    double initial = 0;                   ///< of an argument of a command
};

/// One kind of packet with its fields behind the secondary header.
struct PacketInfo {
    std::string_view name;
    std::string_view help;
    std::uint8_t number = 0; ///< of telemetry: added to the APID; of a command: its function
    std::vector<FieldInfo> fields;
};

/// Value of a field; what its type cannot hold is clamped, NaN of an integer is 0.
using FieldValue = std::variant<std::uint64_t, std::int64_t, double>;

/// The bits of `value` as a field of that type.
[[nodiscard]] std::uint64_t encode(FieldType type, const FieldValue& value);
/// The number that the bits mean.
[[nodiscard]] double decode(FieldType type, std::uint64_t bits);

} // namespace obscura::instrument
