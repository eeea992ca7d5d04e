// SPDX-License-Identifier: Apache-2.0
// Sending of an answer in parts, each of which its client has to take in time.
#pragma once

#include "web/server/stream.hpp"

#include <boost/beast/http/message.hpp>
#include <boost/beast/http/string_body.hpp>

#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>

namespace obscura::web {

/// A part of an answer: what one write hands to the system.
constexpr std::size_t part_bytes = std::size_t{64} << 10;

using Answer = boost::beast::http::response<boost::beast::http::string_body>;

/// `head`: without the body. A client that does not take a part within `timeout` loses the connection;
/// however slow it is otherwise, it gets all of a large file. `done` is called once, with the bytes that were
/// sent; `stream` lives until then.
void write_answer(Stream& stream, std::shared_ptr<Answer> answer, bool head,
                  std::chrono::milliseconds timeout,
                  std::function<void(Stream::ErrorCode, std::size_t)> done);

} // namespace obscura::web
