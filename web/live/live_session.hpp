// SPDX-License-Identifier: Apache-2.0
// WebSocket /api/v1/live: one viewer of live pictures.
#pragma once

#include "web/live/live_pictures.hpp"
#include "web/server/stream.hpp"

#include <boost/beast/http.hpp>

#include <cstddef>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::web {

constexpr std::string_view live_path = "/api/v1/live", live_protocol = "obscura.v1";

/// What the viewers share; of the server's thread.
struct LiveServices {
    static constexpr std::size_t max_viewers = 24;

    std::shared_ptr<LivePictures> pictures;
    /// Why a client of that address may not look with that token; none: it may.
    std::function<std::optional<std::string>(std::string_view token, const std::string& address)> refusal;
    std::size_t viewers = 0;
    WebFigures* figures = nullptr; ///< outlives the sessions
};

using LiveRequest = boost::beast::http::request<boost::beast::http::string_body>;
/// Whether `request` asks for a WebSocket with live_protocol.
[[nodiscard]] bool is_live_upgrade(const LiveRequest& request);

/// Takes over the connection of such a request, whose Host and Origin have been checked. The session lives
/// until the connection ends; `keep` as long. `services` outlives it.
void begin_live_session(Stream stream, const LiveRequest& request, std::string address,
                        LiveServices& services, std::shared_ptr<void> keep);

} // namespace obscura::web
