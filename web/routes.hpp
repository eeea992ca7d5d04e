// SPDX-License-Identifier: Apache-2.0
// Routes of the web server: what is answered under which path, and to whom.
#pragma once

#include "web/access.hpp"
#include "web/daemon_watch.hpp"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace obscura::web {

/// A request as far as routes need it.
struct Request {
    std::string_view method, target;       ///< "GET", "/api/v1/events?after=3"
    std::string_view host, origin, bearer; ///< of the headers; empty: missing
    bool has_host = false, has_origin = false;
    std::string address; ///< of the client, without port
};

/// An answer. `stream_after`: events with larger ids follow as they come, as server-sent events.
struct Response {
    unsigned status = 200;
    std::string_view type; ///< of the body
    std::string body;
    std::vector<std::pair<std::string, std::string>> headers{};
    std::optional<std::uint64_t> stream_after{};
};

/// One row of the table.
struct Route {
    std::string_view path;
    std::optional<Role> role; ///< none: open to all
    std::string_view help;
};
[[nodiscard]] std::span<const Route> routes();

/// Answers requests from what a DaemonWatch has seen. Opens no file and asks no daemon. Thread-bound.
class Routes {
public:
    struct Settings {
        Tokens tokens;
        OwnNames names;
        std::string version;
    };
    /// `watch` outlives this.
    Routes(Settings settings, const DaemonWatch& watch);

    /// Never throws for what a request holds.
    [[nodiscard]] Response answer(const Request& request);
    /// An event as text of the stream.
    [[nodiscard]] static std::string event_text(const WatchedEvent& event);

private:
    [[nodiscard]] Response ready() const;
    [[nodiscard]] Response state() const;
    [[nodiscard]] Response metrics() const;
    [[nodiscard]] Response events(std::string_view query) const;
    /// The refusal; none: the request may go on.
    [[nodiscard]] std::optional<Response> refusal(const Request& request, const Route& route);

    const Settings settings_;
    const DaemonWatch& watch_;
    WrongTokens wrong_;
};

} // namespace obscura::web
