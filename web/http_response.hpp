// SPDX-License-Identifier: Apache-2.0
// Headers of answers: those that all have, and those of one.
#pragma once

#include "web/server/message.hpp"

#include <boost/beast/http/message.hpp>

namespace obscura::web {

/// Sets the headers that keep pages of other sites out, those of `response` and its type.
void set_headers(boost::beast::http::fields& out, const Response& response);

} // namespace obscura::web
