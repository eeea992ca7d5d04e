// SPDX-License-Identifier: Apache-2.0
#include "sync/inputs/ipv4_endpoint.hpp"

#include "config/document.hpp"
#include "core/error.hpp"
#include "core/text/printable.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <charconv>
#include <stdexcept>

namespace obscura::sync {

sockaddr_in parse_ipv4_endpoint(const std::string& text, std::uint16_t lowest_port, const char* example) {
    const std::size_t colon = text.rfind(':');
    sockaddr_in address{};
    address.sin_family = AF_INET;
    std::uint16_t port = 0;
    const auto is_port = [&port](const char* begin, const char* end) {
        const auto [rest, error] = std::from_chars(begin, end, port);
        return error == std::errc() && rest == end;
    };
    const bool good = colon != std::string::npos &&
                      inet_pton(AF_INET, text.substr(0, colon).c_str(), &address.sin_addr) == 1 &&
                      is_port(text.data() + colon + 1, text.data() + text.size()) && port >= lowest_port;
    if (!good)
        throw std::invalid_argument(
            fmt::format("\"{}\": allowed is an IPv4 address and a port, \"{}\"", printable(text), example));
    address.sin_port = htons(port);
    return address;
}

sockaddr_in parse_ipv4_endpoint(const std::string& key, const std::string& text, std::uint16_t lowest_port,
                                const char* example) {
    try {
        return parse_ipv4_endpoint(text, lowest_port, example);
    } catch (const std::invalid_argument& error) {
        throw ConfigError(fmt::format("{}: {}", key, error.what()));
    }
}

} // namespace obscura::sync
