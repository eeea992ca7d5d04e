// SPDX-License-Identifier: Apache-2.0
// Who may talk to the camera, and how often: keeps it from being made an amplifier or a cannon.
#pragma once

#include "core/time.hpp"
#include "transports/gige/channels/network_interface.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::transports::gige {

/// An address range, "192.168.7.0/24" or one address.
struct AddressRange {
    std::uint32_t address = 0, mask = 0xFFFFFFFF;
    [[nodiscard]] bool contains(std::uint32_t ip) const noexcept { return (ip & mask) == (address & mask); }
};
/// Throws ConfigError with one line that names no key.
[[nodiscard]] AddressRange parse_range(const std::string& text);
/// "192.168.7.0/24, 192.168.8.4": separated by commas, blanks do not count. Throws as parse_range().
[[nodiscard]] std::vector<AddressRange> parse_ranges(const std::string& list);

/// Sources off the link are ignored, and so is who is not in a given allow-list. Answers that are longer than
/// their question (DISCOVERY 32 times, READMEM 34 times) come out of a token bucket per source: spoofed
/// requests cannot turn the camera on a third party. Control thread only; a fixed table, nothing allocated
/// after construction.
class SourcePolicy {
public:
    SourcePolicy(const NetworkInterface& network, std::vector<AddressRange> allow, bool off_link);

    [[nodiscard]] bool admits(std::uint32_t ip) const noexcept;
    /// Whether `bytes` of answer to `ip` are within its allowance now; takes them off if so.
    bool spend(std::uint32_t ip, std::size_t bytes, Time now) noexcept;

    static constexpr std::int64_t bytes_per_s = 4'000'000; ///< an XML file every 2 ms
    static constexpr std::int64_t burst_bytes = 1'000'000;

private:
    struct Bucket {
        std::uint32_t ip = 0;
        std::int64_t bytes = burst_bytes;
        Time updated;
    };
    const NetworkInterface network_;
    std::vector<AddressRange> allow_;
    bool off_link_;
    std::array<Bucket, 64> buckets_{};
};

} // namespace obscura::transports::gige
