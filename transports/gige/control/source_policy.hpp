// SPDX-License-Identifier: Apache-2.0
// Access by source address, and rate limit of answers against amplification by spoofed requests.
#pragma once

#include "core/io/address_range.hpp"
#include "core/time.hpp"
#include "transports/gige/channels/network_interface.hpp"

#include <array>
#include <cstdint>
#include <vector>

namespace obscura::transports::gige {

/// Sources off the link, and those missing in a given allow-list, are ignored. Answers longer than their
/// request (DISCOVERY 32 times, READMEM 34 times) are limited by a token bucket per source, so that spoofed
/// requests cannot flood a third party. Thread-bound: control thread. No allocation after construction.
class SourcePolicy {
public:
    SourcePolicy(const NetworkInterface& network, std::vector<AddressRange> allow, bool off_link);

    [[nodiscard]] bool admits(std::uint32_t ip) const noexcept;
    /// Whether an answer of `bytes` to `ip` is within its allowance at `now`; if so, subtracts them.
    bool spend(std::uint32_t ip, std::size_t bytes, Time now) noexcept;

    static constexpr std::int64_t bytes_per_s = 4'000'000; ///< an XML file every 2 ms
    static constexpr std::int64_t burst_bytes = 1'000'000;

private:
    struct Bucket {
        std::int64_t bytes = burst_bytes;
        Time updated;
    };
    const NetworkInterface network_;
    std::vector<AddressRange> allow_;
    bool off_link_;
    std::array<Bucket, 64> buckets_{};
};

} // namespace obscura::transports::gige
