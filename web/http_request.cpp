// SPDX-License-Identifier: Apache-2.0
#include "web/http_request.hpp"

#include "web/api/routes.hpp"
#include "web/server/access.hpp"

// Asio of Boost 1.74 needs it included before.
#include <boost/asio/buffer.hpp>

#include <string>

namespace obscura::web {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using ErrorCode = boost::beast::error_code;

Request request_of(const http::request<http::string_body>& message) {
    const auto value = [&](auto name) {
        const auto found = message[name];
        return std::string_view(found.data(), found.size());
    };
    Request request;
    request.method = {message.method_string().data(), message.method_string().size()};
    request.target = {message.target().data(), message.target().size()};
    request.has_host = message.count(http::field::host) == 1;
    request.host = value(http::field::host);
    request.has_origin = message.count(http::field::origin) > 0;
    request.origin = value(http::field::origin);
    request.content_type = value(http::field::content_type);
    request.if_match = value(http::field::if_match);
    request.if_none_match = value(http::field::if_none_match);
    request.accept = value(http::field::accept);
    request.accept_encoding = value(http::field::accept_encoding);
    request.prefer = value(http::field::prefer);
    request.last_event_id = value("Last-Event-ID");
    request.has_idempotency_key = message.count("Idempotency-Key") > 0;
    request.idempotency_key = value("Idempotency-Key");
    request.body = message.body();
    constexpr std::string_view scheme = "Bearer ";
    if (const std::string_view given = value(http::field::authorization); given.starts_with(scheme))
        request.bearer = given.substr(scheme.size());
    else
        request.password = password_of_basic(given);
    return request;
}

Response refusal_of(ErrorCode error) {
    Response response;
    response.status = error == http::error::header_limit ? 431 : error == http::error::body_limit ? 413 : 400;
    response.type = "text/plain; charset=utf-8";
    response.body = error.message() + "\n";
    return response;
}

void set_limits(Parser& parser, const HttpLimits& limits) {
    parser.header_limit(limits.header_bytes);
    parser.body_limit(limits.body_bytes);
}

std::optional<Response> answer_to(Routes& routes, const HttpLimits& limits, std::string_view bytes) {
    Parser parser;
    set_limits(parser, limits);
    parser.eager(true);
    while (!parser.is_done()) {
        ErrorCode error;
        const std::size_t used = parser.put(asio::buffer(bytes.data(), bytes.size()), error);
        if (error == http::error::need_more) return std::nullopt;
        if (error) return refusal_of(error);
        bytes.remove_prefix(used);
        if (used == 0 || (bytes.empty() && !parser.is_done())) return std::nullopt;
    }
    return routes.answer(request_of(parser.get()));
}

} // namespace obscura::web
