// SPDX-License-Identifier: Apache-2.0
// Requests and answers of the web server, free of HTTP's syntax.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::web {

/// A request as far as routes need it. Views are of the received message.
struct Request {
    std::string_view method, target;       ///< "GET", "/api/v1/events?after=3"
    std::string_view host, origin, bearer; ///< of the headers; empty: missing
    std::string_view content_type, if_match, if_none_match, accept, accept_encoding, prefer, idempotency_key,
        last_event_id;
    std::string_view body;
    bool has_host = false, has_origin = false, has_idempotency_key = false;
    std::string password; ///< of the scheme Basic; empty: missing
    std::string address;  ///< of the client, without port
};

struct Response;

/// What a worker has to do for an answer, see Worker.
struct Job {
    /// Jobs of one lane follow each other; a lane for each daemon, "" for jobs that ask none.
    std::string lane{};
    /// Jobs of one queue have places of their own, so that waiting for frames keeps no command out.
    enum class Queue : std::uint8_t { calls, frames } queue = Queue::calls;
    /// Goes on for a short time; none: not done, to be called again. Does not throw.
    std::function<std::optional<Response>()> step;
};

/// An answer.
struct Response {
    unsigned status = 200;
    std::string_view type; ///< of the body
    std::string body;
    std::vector<std::pair<std::string, std::string>> headers{};
    /// Events with larger ids follow `body` as they come, as server-sent events.
    std::optional<std::uint64_t> stream_after{};
    /// Pictures of the camera of that id follow, see begin_mjpeg_session(); empty: none.
    std::string pictures_of{};
    std::optional<Job> job{};    ///< makes the answer that is sent instead of this one
    std::string_view route{};    ///< id of the row of the table of routes, or another word; static
    std::string session{};       ///< name of who was admitted to ask; empty: the route is open
    bool may_have_acted = false; ///< though it is a refusal: what a daemon was asked to do has no answer
};

} // namespace obscura::web
