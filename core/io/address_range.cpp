// SPDX-License-Identifier: Apache-2.0
#include "core/io/address_range.hpp"

#include "core/error.hpp"
#include "core/text/printable.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <system_error>

namespace obscura {

AddressRange parse_address_range(const std::string& text) {
    constexpr std::size_t max_quoted = 60;
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
                                      for_terminal(text.substr(0, max_quoted))));
    return {ntohl(parsed.s_addr), bits == 0 ? 0 : 0xFFFFFFFFU << (32 - bits)};
}

std::vector<AddressRange> parse_address_ranges(const std::string& list) {
    std::vector<AddressRange> ranges;
    std::string word;
    for (const char c : list + ",") {
        if (c == ',') {
            if (!word.empty()) ranges.push_back(parse_address_range(word));
            word.clear();
        } else if (c != ' ' && c != '\t') {
            word += c;
        }
    }
    return ranges;
}

bool any_contains(std::span<const AddressRange> ranges, std::uint32_t ip) noexcept {
    return std::any_of(ranges.begin(), ranges.end(),
                       [ip](const AddressRange& one) { return one.contains(ip); });
}

} // namespace obscura
