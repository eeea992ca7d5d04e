// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/control/source_policy.hpp"

#include <algorithm>
#include <utility>

namespace obscura::transports::gige {

SourcePolicy::SourcePolicy(const NetworkInterface& network, std::vector<AddressRange> allow, bool off_link)
    : network_(network), allow_(std::move(allow)), off_link_(off_link) {}

bool SourcePolicy::admits(std::uint32_t ip) const noexcept {
    if (!off_link_ && !network_.on_link(ip)) return false;
    return allow_.empty() || any_contains(allow_, ip);
}

bool SourcePolicy::spend(std::uint32_t ip, std::size_t bytes, Time now) noexcept {
    // Direct mapped: two sources with the same bucket share its allowance, which errs on the safe side.
    Bucket& bucket = buckets_[ip * 2654435761U >> 26];
    const std::int64_t span_ns = std::clamp<std::int64_t>(now - bucket.updated, 0, ns_per_s);
    bucket.bytes = std::min(burst_bytes, bucket.bytes + span_ns * (bytes_per_s / 1000) / (ns_per_s / 1000));
    bucket.updated = now;
    if (bucket.bytes < static_cast<std::int64_t>(bytes)) return false;
    bucket.bytes -= static_cast<std::int64_t>(bytes);
    return true;
}

} // namespace obscura::transports::gige
