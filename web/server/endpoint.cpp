// SPDX-License-Identifier: Apache-2.0
#include "web/server/endpoint.hpp"

#include "core/error.hpp"

#include <fmt/format.h>

#include <charconv>
#include <cstdint>

namespace obscura::web {

boost::asio::ip::tcp::endpoint endpoint_of(const std::string& address) {
    const std::size_t colon = address.rfind(':');
    const auto refuse = [&] {
        throw InputError(fmt::format(
            "\"{}\": an address and a port are allowed, like 127.0.0.1:8420 or [::1]:8420", address));
    };
    if (colon == std::string::npos) refuse();
    std::string host = address.substr(0, colon);
    if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
    boost::system::error_code error;
    const boost::asio::ip::address ip = boost::asio::ip::make_address(host, error);
    std::uint16_t port = 0;
    const char* const end = address.data() + address.size();
    const auto [stop, bad] = std::from_chars(address.data() + colon + 1, end, port);
    if (error || bad != std::errc{} || stop != end) refuse();
    return {ip, port};
}

} // namespace obscura::web
