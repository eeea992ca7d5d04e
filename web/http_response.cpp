// SPDX-License-Identifier: Apache-2.0
#include "web/http_response.hpp"

#include <array>
#include <utility>

namespace obscura::web {
namespace {

constexpr std::array<std::pair<const char*, const char*>, 6> headers_of_all{{
    {"Content-Security-Policy",
     "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
     "img-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; "
     "require-trusted-types-for 'script'"},
    {"X-Content-Type-Options", "nosniff"},
    {"X-Frame-Options", "DENY"},
    {"Referrer-Policy", "no-referrer"},
    {"Cross-Origin-Resource-Policy", "same-origin"},
    {"Cache-Control", "no-store"},
}};

} // namespace

void set_headers(boost::beast::http::fields& out, const Response& response) {
    for (const auto& [name, text] : headers_of_all)
        out.set(name, text);
    for (const auto& [name, text] : response.headers)
        out.set(name, text);
    out.set(boost::beast::http::field::content_type, response.type);
}

} // namespace obscura::web
