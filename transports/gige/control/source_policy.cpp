// SPDX-License-Identifier: Apache-2.0
#include "transports/gige/control/source_policy.hpp"

#include "config/document.hpp"
#include "core/error.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <utility>

namespace obscura::transports::gige {

AddressRange parse_range(const std::string& text) {
    const std::size_t slash = text.find('/');
    in_addr parsed{};
    unsigned bits = 32;
    bool good = inet_pton(AF_INET, text.substr(0, slash).c_str(), &parsed) == 1;
    if (slash != std::string::npos) {
        const char* const end = text.data() + text.size();
        const auto [stop, error] = std::from_chars(text.data() + slash + 1, end, bits);
        good = good && error == std::errc{} && stop == end && bits <= 32;
    }
    if (!good)
        throw ConfigError(fmt::format("\"{}\": allowed is an IPv4 address or a range like 192.168.7.0/24",
                                      config::printable(text)));
    return {ntohl(parsed.s_addr), bits == 0 ? 0 : 0xFFFFFFFFU << (32 - bits)};
}

std::vector<AddressRange> parse_ranges(const std::string& list) {
    std::vector<AddressRange> ranges;
    std::string word;
    for (const char c : list + ",") {
        if (c == ',') {
            if (!word.empty()) ranges.push_back(parse_range(word));
            word.clear();
        } else if (c != ' ' && c != '\t') {
            word += c;
        }
    }
    return ranges;
}

SourcePolicy::SourcePolicy(const NetworkInterface& network, std::vector<AddressRange> allow, bool off_link)
    : network_(network), allow_(std::move(allow)), off_link_(off_link) {}

bool SourcePolicy::admits(std::uint32_t ip) const noexcept {
    if (!off_link_ && !network_.on_link(ip)) return false;
    return allow_.empty() ||
           std::any_of(allow_.begin(), allow_.end(), [ip](const AddressRange& r) { return r.contains(ip); });
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
