// SPDX-License-Identifier: Apache-2.0
// CRC-32C (Castagnoli, RFC 3720): by the processor's instruction where it has one.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace obscura::terrain {

/// CRC-32C of `bytes` after those whose CRC is `before`. Real-time safe.
[[nodiscard]] std::uint32_t crc32c(std::span<const std::byte> bytes, std::uint32_t before = 0) noexcept;
/// The same by tables, on any processor.
[[nodiscard]] std::uint32_t crc32c_by_tables(std::span<const std::byte> bytes,
                                             std::uint32_t before = 0) noexcept;

} // namespace obscura::terrain
