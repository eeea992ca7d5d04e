// SPDX-License-Identifier: Apache-2.0
// Routes of the web server: who may ask what, and who answers it.
#pragma once

#include "web/access.hpp"
#include "web/audit.hpp"
#include "web/camera_jobs.hpp"
#include "web/daemon_watch.hpp"
#include "web/message.hpp"
#include "web/route_table.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace obscura::web {

/// Answers requests from what a DaemonWatch has seen, or by jobs that call its daemons. Opens no file and
/// waits for nothing. Thread-bound; the jobs are for one worker's thread, which ends before this.
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
    /// Why a client of that address may not look with that token; none: it may.
    [[nodiscard]] std::optional<std::string> token_refusal(std::string_view token,
                                                           const std::string& address);
    /// An event as text of the stream.
    [[nodiscard]] static std::string event_text(const WatchedEvent& event);

private:
    [[nodiscard]] Response checked_answer(const Request& request);
    [[nodiscard]] Response dispatch(const Request& request, const Match& match, std::string_view query,
                                    const Holder& holder);
    [[nodiscard]] Response ready() const;
    [[nodiscard]] Response state() const;
    [[nodiscard]] Response events(const nlohmann::ordered_json& query) const;
    [[nodiscard]] Response camera_job(const Request& request, const Match& match,
                                      nlohmann::ordered_json query, const Holder& holder);
    /// Who asks. Throws Refusal unless that one may.
    [[nodiscard]] Holder admit(const Request& request, Role wanted);

    const Settings settings_;
    const DaemonWatch& watch_;
    WrongTokens wrong_;
    Audit audit_;
    CameraJobs jobs_{audit_};
    std::string openapi_; ///< made for the first who asks
};

} // namespace obscura::web
