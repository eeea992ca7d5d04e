// SPDX-License-Identifier: Apache-2.0
// Calls of daemons for the web server: connections that are kept, limits of time, refusals as problems.
#pragma once

#include "host/call_client.hpp"
#include "web/live/daemon_watch.hpp"

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::web {

/// A camera, and where its daemon takes calls.
struct CameraPlace {
    std::string id; ///< "PID-N"
    DaemonRun daemon;
    std::uint32_t number = 0; ///< in its configuration
    std::string control;      ///< address of the calls
    std::string controller{}; ///< address of the GigE Vision client that controls it; empty: none
};
/// The id of a camera that is named by its number in the configuration of the only daemon; any other text as
/// it is. Throws Refusal (422) where there are several daemons.
[[nodiscard]] std::string camera_id(const Sighting& sighting, std::string_view camera);
/// The camera of that id. Throws Refusal: 404, or 503 if its daemon takes no calls.
[[nodiscard]] CameraPlace find_camera(const Sighting& sighting, std::string_view id);

/// Thread-safe. All members throw Refusal with the daemon's text: 409 if another client controls the
/// camera, or its state does not allow it, 403, 422, and 503 if the daemon does not answer or has no such
/// call.
class DaemonCalls {
public:
    using Json = nlohmann::ordered_json;
    using Answer = host::CallClient::Answer;
    using Clock = std::chrono::steady_clock;

    static constexpr std::chrono::milliseconds answer_timeout{5000}; ///< of calls that answer at once

    /// A call that waits for its answer. Destroying it cancels the call.
    struct Running {
        CameraPlace place;
        std::unique_ptr<host::CallClient> client;
        Clock::time_point begun, deadline;
    };

    /// Makes a call that answers at once.
    Answer call(const CameraPlace& place, const std::string& name, const Json& fields);
    /// Sends a request whose answer may take `timeout`.
    [[nodiscard]] Running begin(const CameraPlace& place, const std::string& name, const Json& fields,
                                std::chrono::milliseconds timeout);
    /// The answer; none: it is not there yet. Waits a few milliseconds.
    [[nodiscard]] std::optional<Answer> look(Running& running);

private:
    [[nodiscard]] std::optional<Answer> wait(Running& running, std::chrono::milliseconds longest);
    [[nodiscard]] std::unique_ptr<host::CallClient> take(const CameraPlace& place);
    void keep(Running& running);

    /// Has calls refused for a while.
    void note_silent(const CameraPlace& place);

    struct Kept {
        DaemonRun daemon;
        std::unique_ptr<host::CallClient> client;
    };
    std::mutex mutex_;       ///< of what follows
    std::vector<Kept> kept_; ///< the oldest first
    /// Daemons that did not answer, and until when they are not asked again.
    std::map<DaemonRun, Clock::time_point> silent_;
};

} // namespace obscura::web
