// SPDX-License-Identifier: Apache-2.0
// Ranges of IPv4 addresses, from which requests are taken.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace obscura {

/// An address range, "192.168.7.0/24" or one address; numbers in host byte order.
struct AddressRange {
    std::uint32_t address = 0, mask = 0xFFFFFFFF;
    [[nodiscard]] bool contains(std::uint32_t ip) const noexcept { return (ip & mask) == (address & mask); }
};

/// Throws ConfigError with one line that names no key.
[[nodiscard]] AddressRange parse_address_range(const std::string& text);
/// "192.168.7.0/24, 192.168.8.4": separated by commas, blanks are ignored. Throws as parse_address_range()
/// does.
[[nodiscard]] std::vector<AddressRange> parse_address_ranges(const std::string& list);

/// Whether one of the ranges contains the address. Real-time safe.
[[nodiscard]] bool any_contains(std::span<const AddressRange> ranges, std::uint32_t ip) noexcept;

} // namespace obscura
