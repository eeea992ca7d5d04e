// SPDX-License-Identifier: Apache-2.0
// Requests in the syntax of HTTP/1.1, within limits.
#pragma once

#include "web/server/message.hpp"

#include <boost/beast/core/error.hpp>
#include <boost/beast/http/message.hpp>
#include <boost/beast/http/parser.hpp>
#include <boost/beast/http/string_body.hpp>

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>

namespace obscura::web {

class Routes;

/// What clients may take.
struct HttpLimits {
    std::size_t connections = 256;
    /// Connections of one address on which no request has shown that it may ask: users behind one proxy share
    /// an address, so that others count as those of their session.
    std::size_t strangers_of_one_address = 64;
    std::size_t of_one_session = 128; ///< connections of the holder of one token, all tabs together
    /// Further connections, which get /livez and are refused everything else.
    std::size_t for_health = 2;
    std::size_t streams = 24;
    std::uint32_t header_bytes = 8192;
    std::uint64_t body_bytes = 196608; ///< for the text of a model, whose line ends JSON writes as two bytes
    /// Size of all answers that are being sent; a single one may be larger.
    std::size_t answer_bytes = std::size_t{64} << 20;
    std::chrono::milliseconds header_ms{2000}; ///< from the first byte of a request to the end of its header
    std::chrono::milliseconds body_ms{5000}, idle_ms{30000};
    std::chrono::milliseconds write_ms{10000}; ///< in which a client takes the next part of an answer
};

using Parser = boost::beast::http::request_parser<boost::beast::http::string_body>;
void set_limits(Parser& parser, const HttpLimits& limits);

/// Views of the message.
[[nodiscard]] Request request_of(const boost::beast::http::request<boost::beast::http::string_body>& message);
/// Refusal of a request by its header: a body whose end is not known (RFC 9112, 6.1 and 6.3), or an
/// expectation that is not met (RFC 9110, 10.1.1). The connection ends behind it: what follows is not where
/// the next request begins.
[[nodiscard]] std::optional<Response> refusal_of_header(const Parser& parser);
/// Whether the client waits for "100 Continue" before it sends the body.
[[nodiscard]] bool waits_for_continue(const Parser& parser);
/// Refusal of a request that cannot be read.
[[nodiscard]] Response refusal_of(boost::beast::error_code error);

/// What a connection would answer to the first request in `bytes` without doing its job, for tests and
/// fuzzing; none: the request is not whole.
[[nodiscard]] std::optional<Response> answer_to(Routes& routes, const HttpLimits& limits,
                                                std::string_view bytes);

} // namespace obscura::web
