// SPDX-License-Identifier: Apache-2.0
// Offsets and codes of the star catalogue file, for its reader and writer: see star_file.hpp.
#pragma once

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <limits>
#include <string_view>

namespace obscura::ephemeris::star_layout {

inline constexpr std::string_view magic = "OBSTARS\n";
inline constexpr std::uint32_t version = 1;
inline constexpr std::size_t header_bytes = 256, record_bytes = 36;
inline constexpr std::int32_t unknown_completeness = std::numeric_limits<std::int32_t>::min();
inline constexpr std::int16_t unknown_colour = std::numeric_limits<std::int16_t>::min();
inline constexpr std::uint32_t max_type_hundredths = 699, luminosity_step = 1000;

/// Offsets in the header.
namespace header {
inline constexpr std::size_t version = 8, header_bytes = 12, record_bytes = 16, edge = 20, stars = 24,
                             file_bytes = 32, brightest = 40, faintest = 44, complete = 48, motion = 52,
                             parallax = 56, records_crc = 60, source = 64, crc = 252;
}
/// Offsets in a record.
namespace record {
inline constexpr std::size_t u = 0, v = 4, motion_ra = 8, motion_dec = 12, parallax = 16, id = 20,
                             magnitude = 28, colour = 30, type = 32, face = 34, untyped_class = 35;
}

/// Integer of `Integer`'s size at `at`, little endian.
template<typename Integer>
Integer get(const std::byte* at) noexcept {
    if constexpr (sizeof(Integer) == 1) return static_cast<Integer>(*at);
    std::uint64_t value = 0;
    for (std::size_t i = sizeof(Integer); i-- > 0;)
        value = value << 8 | std::to_integer<std::uint64_t>(at[i]);
    return static_cast<Integer>(value);
}

template<typename Integer>
void put(std::byte* at, Integer integer) noexcept {
    auto value = static_cast<std::uint64_t>(integer);
    for (std::size_t i = 0; i < sizeof(Integer); ++i, value >>= 8)
        at[i] = static_cast<std::byte>(value & 0xFF);
}

} // namespace obscura::ephemeris::star_layout
