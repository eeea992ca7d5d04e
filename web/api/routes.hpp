// SPDX-License-Identifier: Apache-2.0
// Routes of the web server: who may ask what, and who answers it.
#pragma once

#include "web/api/camera_jobs.hpp"
#include "web/api/kept_answers.hpp"
#include "web/api/route_table.hpp"
#include "web/live/daemon_watch.hpp"
#include "web/live/kept_frames.hpp"
#include "web/live/web_figures.hpp"
#include "web/server/access.hpp"
#include "web/server/audit.hpp"
#include "web/server/message.hpp"

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::web {

/// Answers requests from what a DaemonWatch has seen, or by jobs that call its daemons. Opens no file and
/// waits for nothing. Thread-bound; the jobs are for a worker, which ends before this.
class Routes {
public:
    struct Settings {
        Tokens tokens;
        OwnNames names;
        std::string version;
        std::shared_ptr<WebFigures> figures = std::make_shared<WebFigures>(); ///< not null
        std::shared_ptr<KeptFrames> frames = std::make_shared<KeptFrames>();  ///< that viewers see; not null
    };
    /// `watch` outlives this.
    Routes(Settings settings, const DaemonWatch& watch);

    /// Never throws for what a request holds.
    [[nodiscard]] Response answer(const Request& request);
    /// Why a client of that address may not look with that token; none: it may.
    [[nodiscard]] std::optional<std::string> token_refusal(std::string_view token,
                                                           const std::string& address);
    [[nodiscard]] WebFigures& figures() const noexcept { return *settings_.figures; }
    /// An event as text of the stream; `run`: DaemonWatch::run().
    [[nodiscard]] static std::string event_text(const WatchedEvent& event, const std::string& run);
    /// Text of the stream where events are lost between those two ids, or all of an earlier run of this
    /// server, whose number is not known.
    [[nodiscard]] static std::string lost_text(std::uint64_t after, std::uint64_t next);

private:
    /// `route` receives the id of the route.
    [[nodiscard]] Response checked_answer(const Request& request, std::string_view& route);
    [[nodiscard]] Response dispatch(const Request& request, const Match& match, std::string_view query,
                                    const Holder& holder);
    [[nodiscard]] Response ready() const;
    [[nodiscard]] Response state() const;
    [[nodiscard]] Response cameras() const;
    /// Throws Refusal.
    [[nodiscard]] Response camera(std::string_view id) const;
    /// `last_id`: header Last-Event-ID of a client that was cut off. Throws Refusal.
    [[nodiscard]] Response events(const nlohmann::ordered_json& query, std::string_view last_id) const;
    [[nodiscard]] Response camera_job(const Request& request, const Match& match,
                                      nlohmann::ordered_json query, const Holder& holder);
    /// The id of that camera; empty: of the first one. Throws Refusal.
    [[nodiscard]] std::string seen_camera(std::string_view camera) const;
    /// Holder of the token. Throws Refusal unless its role suffices.
    [[nodiscard]] Holder admit(const Request& request, const Route& route);
    [[nodiscard]] Holder admit(std::string_view token, const std::string& address, Role wanted);

    const Settings settings_;
    const DaemonWatch& watch_;
    WrongTokens wrong_;
    Audit audit_;
    CameraJobs jobs_{audit_, settings_.frames};
    KeptAnswers kept_;
    std::string openapi_, zipped_openapi_; ///< made for the first who asks
};

} // namespace obscura::web
