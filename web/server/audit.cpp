// SPDX-License-Identifier: Apache-2.0
#include "web/server/audit.hpp"

#include "core/realtime/log.hpp"
#include "web/server/problem.hpp"

#include <fmt/format.h>

#include <chrono>
#include <ctime>
#include <utility>

namespace obscura::web {
namespace {

std::string utc_now() {
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
    const auto s = static_cast<std::time_t>(ms / 1000);
    std::tm parts{};
    char text[32];
    const std::size_t bytes = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", ::gmtime_r(&s, &parts));
    return fmt::format("{}.{:03}Z", std::string_view(text, bytes), ms % 1000);
}

} // namespace

void Audit::note(Change change) {
    const std::string before = dumped(change.before), after = dumped(change.after);
    log_notice("web: {} at {}: {} of camera {}: {} -> {}", change.who, change.peer,
               change.forced ? change.what + " by force" : change.what, change.camera, before, after);
    const std::lock_guard lock(mutex_);
    rows_.push_back({{"id", ++last_},
                     {"utc", utc_now()},
                     {"who", std::move(change.who)},
                     {"peer", std::move(change.peer)},
                     {"what", std::move(change.what)},
                     {"camera", std::move(change.camera)},
                     {"before", std::move(change.before)},
                     {"after", std::move(change.after)},
                     {"forced", change.forced}});
    if (rows_.size() > most) rows_.pop_front();
}

nlohmann::ordered_json Audit::list(std::uint64_t after) const {
    const std::lock_guard lock(mutex_);
    if (after > last_) after = 0; // of another run
    nlohmann::ordered_json rows = nlohmann::ordered_json::array();
    for (const nlohmann::ordered_json& row : rows_)
        if (row["id"].get<std::uint64_t>() > after) rows.push_back(row);
    return {{"changes", std::move(rows)}, {"last", last_}};
}

} // namespace obscura::web
