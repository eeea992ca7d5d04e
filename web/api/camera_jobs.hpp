// SPDX-License-Identifier: Apache-2.0
// Jobs that answer requests about a camera by calls of its daemon.
#pragma once

#include "web/api/daemon_calls.hpp"
#include "web/api/frame_file.hpp"
#include "web/api/route_table.hpp"
#include "web/live/kept_frames.hpp"
#include "web/server/audit.hpp"
#include "web/server/message.hpp"

#include <nlohmann/json.hpp>

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>

namespace obscura::web {

/// A request about a camera, checked by the table.
struct CameraRequest {
    const Route* route = nullptr;
    CameraPlace place;
    std::string feature;                ///< of the path; empty: none
    std::optional<std::uint64_t> frame; ///< of the path; its place has an id only
    std::string_view form;              ///< suffix of the file that a frame becomes; static
    nlohmann::ordered_json query, body; ///< objects
    std::string if_match, who, peer;
};

/// Integers that a double cannot hold, as page and MATLAB read them, become strings.
void make_exact(nlohmann::ordered_json& json);

/// The jobs run on threads of a worker, which ends before this.
class CameraJobs {
public:
    /// `frames` is where frames are kept that have been answered with, and found.
    CameraJobs(Audit& audit, std::shared_ptr<KeptFrames> frames)
        : audit_(audit), frames_(std::move(frames)) {}
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
    /// The answer to the call of the route with the fields of the request; none: it is not there yet.
    [[nodiscard]] std::optional<DaemonCalls::Answer> answer(State& state, std::chrono::milliseconds timeout);
    /// That answer as it is.
    [[nodiscard]] std::optional<Response> call(State& state);
    [[nodiscard]] Response features(const State& state);
    [[nodiscard]] Response set_features(const State& state);
    [[nodiscard]] Response feature(const State& state);
    [[nodiscard]] Response set_feature(const State& state);
    /// `values`: all settings before; becomes those after.
    [[nodiscard]] Response change(const State& state, Json wanted, nlohmann::json& values);
    [[nodiscard]] Response acquisition(const State& state);
    [[nodiscard]] Response faults(const State& state);
    [[nodiscard]] Response set_faults(const State& state);
    [[nodiscard]] Response scenes(const State& state);
    [[nodiscard]] Response configuration(const State& state);
    [[nodiscard]] Response set_device(const State& state);
    [[nodiscard]] Response set_log_level(const State& state);
    [[nodiscard]] Response release(const State& state);
    [[nodiscard]] std::optional<Response> self_test(State& state);
    [[nodiscard]] Response support_bundle(const State& state);
    [[nodiscard]] std::optional<Response> set_configuration(State& state);
    [[nodiscard]] std::optional<Response> trigger(State& state);
    [[nodiscard]] std::optional<Response> show_scene(State& state);
    [[nodiscard]] std::optional<Response> probe(State& state);
    [[nodiscard]] std::optional<Response> frame(State& state);
    [[nodiscard]] std::optional<Response> irradiance(State& state);
    [[nodiscard]] Response frame_of_path(const State& state);
    [[nodiscard]] Response file_of(const State& state, const KeptFrame& frame);

    Json ask(const State& state, const char* call, Json fields = Json::object());
    void note(const State& state, Json before, Json after, bool forced = false);
    /// Throws Refusal (412) if the request is for another value than that of `tag`.
    static void check_tag(const State& state, const std::string& tag);

    Audit& audit_;
    const std::shared_ptr<KeptFrames> frames_;
    DaemonCalls calls_;
    FrameFiles files_;
};

} // namespace obscura::web
