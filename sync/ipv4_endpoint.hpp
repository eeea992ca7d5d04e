// The IPv4 address and port of a configuration's "listen" keys.
#pragma once

#include <netinet/in.h>

#include <cstdint>
#include <string>

namespace obscura::sync {

/// "127.0.0.1:5002" as a socket address. Throws ConfigError that names `key` and shows `example`.
/// \param lowest_port 0 where the kernel may choose one that is free, else 1
[[nodiscard]] sockaddr_in parse_ipv4_endpoint(const std::string& key, const std::string& text,
                                              std::uint16_t lowest_port, const char* example);

} // namespace obscura::sync
