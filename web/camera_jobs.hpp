// SPDX-License-Identifier: Apache-2.0
// Jobs that answer requests about a camera by calls of its daemon.
#pragma once

#include "web/audit.hpp"
#include "web/daemon_calls.hpp"
#include "web/frame_file.hpp"
#include "web/message.hpp"
#include "web/route_table.hpp"

#include <nlohmann/json.hpp>

#include <memory>
#include <optional>
#include <string>

namespace obscura::web {

/// A request about a camera, checked by the table.
struct CameraRequest {
    const Route* route = nullptr;
    CameraPlace place;
    nlohmann::ordered_json query, body; ///< objects
    std::string if_match, who, peer;
};

/// The jobs run on one worker's thread, which ends before this.
class CameraJobs {
public:
    explicit CameraJobs(Audit& audit) : audit_(audit) {}
    /// Thread-safe.
    [[nodiscard]] Job job(CameraRequest request);

private:
    using Json = nlohmann::ordered_json;
    struct State {
        CameraRequest request;
        std::optional<DaemonCalls::Running> running{};
        Json before{};
    };
    [[nodiscard]] std::optional<Response> step(State& state);
    [[nodiscard]] Response read(const State& state, const char* call, Json fields);
    [[nodiscard]] Response features(const State& state);
    [[nodiscard]] Response set_features(const State& state);
    [[nodiscard]] Response acquisition(const State& state);
    [[nodiscard]] Response faults(const State& state);
    [[nodiscard]] Response set_faults(const State& state);
    [[nodiscard]] Response scenes(const State& state);
    [[nodiscard]] std::optional<Response> trigger(State& state);
    [[nodiscard]] std::optional<Response> show_scene(State& state);
    [[nodiscard]] std::optional<Response> frame(State& state);

    Json ask(const State& state, const char* call, Json fields = Json::object());
    void note(const State& state, Json before, Json after, bool forced = false);
    /// Throws Refusal (412) if the request is for another value than that of `tag`.
    static void check_tag(const State& state, const std::string& tag);

    Audit& audit_;
    DaemonCalls calls_;
    FrameFiles files_;
};

} // namespace obscura::web
