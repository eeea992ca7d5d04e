// SPDX-License-Identifier: Apache-2.0
// IPv4 address and UDP or TCP port of configuration keys named "listen".
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>

namespace obscura::sync {

/// Parses an endpoint such as "127.0.0.1:5002" to a socket address. Throws std::invalid_argument that quotes
/// `text` and shows `example`.
/// \param lowest_port 0 if the kernel may choose a free port, else 1
[[nodiscard]] sockaddr_in parse_ipv4_endpoint(const std::string& text, std::uint16_t lowest_port,
                                              const char* example);

/// Parses an endpoint when the socket is opened: throws ConfigError that names `key`.
[[nodiscard]] sockaddr_in parse_ipv4_endpoint(const std::string& key, const std::string& text,
                                              std::uint16_t lowest_port, const char* example);

} // namespace obscura::sync
