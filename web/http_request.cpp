// SPDX-License-Identifier: Apache-2.0
#include "web/http_request.hpp"

#include "core/text/text.hpp"
#include "web/api/routes.hpp"
#include "web/server/access.hpp"

// Asio of Boost 1.74 needs it included before.
#include <boost/asio/buffer.hpp>

#include <string>
#include <utility>

namespace obscura::web {

namespace asio = boost::asio;
namespace http = boost::beast::http;
using ErrorCode = boost::beast::error_code;

namespace {

template<typename Name>
std::string_view header_of(const http::request<http::string_body>& message, Name name) {
    const auto found = message[name];
    return {found.data(), found.size()};
}

/// The target in absolute form (RFC 9112, 3.2.2), as proxies get it, without scheme and authority; others as
/// they are.
std::string_view path_of(std::string_view target) {
    for (const std::string_view scheme : {"http://", "https://"})
        if (lower_case(target.substr(0, scheme.size())) == scheme) {
            const std::size_t path = target.find('/', scheme.size());
            return path == std::string_view::npos ? "/" : target.substr(path);
        }
    return target;
}

Response plain_refusal(unsigned status, std::string body) {
    Response response;
    response.status = status;
    response.type = "text/plain; charset=utf-8";
    response.body = std::move(body);
    return response;
}

} // namespace

std::optional<Response> refusal_of_header(const Parser& parser) {
    const auto& message = parser.get();
    const std::size_t codings = message.count(http::field::transfer_encoding);
    const std::string coding = lower_case(header_of(message, http::field::transfer_encoding));
    if (codings > 0 && message.version() < 11)
        return plain_refusal(400, "HTTP/1.0 has no Transfer-Encoding\n");
    if (codings > 1 || (codings == 1 && trimmed(coding) != "chunked"))
        return plain_refusal(400, "Transfer-Encoding: allowed is chunked alone\n");
    const std::string expected = lower_case(header_of(message, http::field::expect));
    if (!expected.empty() && expected != "100-continue")
        return plain_refusal(417, "Expect: allowed is 100-continue\n");
    return std::nullopt;
}

bool waits_for_continue(const Parser& parser) {
    return parser.get().version() >= 11 && parser.get().count(http::field::expect) > 0 && !parser.is_done();
}

Request request_of(const http::request<http::string_body>& message) {
    const auto value = [&](auto name) { return header_of(message, name); };
    Request request;
    request.method = {message.method_string().data(), message.method_string().size()};
    request.target = path_of({message.target().data(), message.target().size()});
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
    const std::string_view authorization = value(http::field::authorization);
    request.bearer = credentials_of(authorization, "bearer");
    request.password = password_of_basic(authorization);
    return request;
}

Response refusal_of(ErrorCode error) {
    return plain_refusal(error == http::error::header_limit ? 431
                         : error == http::error::body_limit ? 413
                                                            : 400,
                         error.message() + "\n");
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
        if (parser.is_header_done())
            if (auto refused = refusal_of_header(parser)) return refused;
        if (used == 0 || (bytes.empty() && !parser.is_done())) return std::nullopt;
    }
    return routes.answer(request_of(parser.get()));
}

} // namespace obscura::web
