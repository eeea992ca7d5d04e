// SPDX-License-Identifier: Apache-2.0
// Address and port where a server listens, as its users write them.
#pragma once

#include <boost/asio/ip/tcp.hpp>

#include <string>

namespace obscura::web {

/// Of "127.0.0.1:8420" or "[::1]:8420". Throws InputError.
boost::asio::ip::tcp::endpoint endpoint_of(const std::string& address);

} // namespace obscura::web
