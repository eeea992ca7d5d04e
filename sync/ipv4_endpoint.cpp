#include "sync/ipv4_endpoint.hpp"

#include "core/error.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <charconv>

namespace obscura::sync {

sockaddr_in parse_ipv4_endpoint(const std::string& key, const std::string& text, std::uint16_t lowest_port,
                                const char* example) {
    const std::size_t colon = text.rfind(':');
    sockaddr_in address{};
    address.sin_family = AF_INET;
    std::uint16_t port = 0;
    const char* end = text.data() + text.size();
    const bool good = colon != std::string::npos &&
                      inet_pton(AF_INET, text.substr(0, colon).c_str(), &address.sin_addr) == 1 &&
                      std::from_chars(text.data() + colon + 1, end, port).ptr == end &&
                      colon + 1 < text.size() && port >= lowest_port;
    if (!good)
        throw ConfigError(
            fmt::format("{}: \"{}\": allowed is an IPv4 address and a port, \"{}\"", key, text, example));
    address.sin_port = htons(port);
    return address;
}

} // namespace obscura::sync
