// SPDX-License-Identifier: Apache-2.0
#include "web/daemon_watch.hpp"

#include "core/error.hpp"
#include "tools/support/monitor_client.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <utility>

namespace obscura::web {

using Json = nlohmann::ordered_json;

DaemonWatch::DaemonWatch(std::string socket, std::chrono::milliseconds period, DaemonVisitor* visitor)
    : socket_(std::move(socket)), period_(period), visitor_(visitor) {
    auto none = std::make_shared<Sighting>();
    none->error = "no daemon has been asked yet";
    none->at = std::chrono::steady_clock::now();
    latest_ = std::move(none);
    thread_ = std::thread([this] { watch(); });
}

DaemonWatch::~DaemonWatch() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    stopping_.notify_all();
    thread_.join();
}

std::shared_ptr<const Sighting> DaemonWatch::latest() const {
    const std::lock_guard lock(mutex_);
    return latest_;
}

std::vector<WatchedEvent> DaemonWatch::events(std::uint64_t after, std::size_t most) const {
    const std::lock_guard lock(mutex_);
    const auto first = std::upper_bound(events_.begin(), events_.end(), after,
                                        [](std::uint64_t id, const WatchedEvent& e) { return id < e.id; });
    const auto count = std::min<std::size_t>(most, static_cast<std::size_t>(events_.end() - first));
    return {first, first + static_cast<std::ptrdiff_t>(count)};
}

void DaemonWatch::look_soon() {
    {
        const std::lock_guard lock(mutex_);
        soon_ = true;
    }
    stopping_.notify_all();
}

void DaemonWatch::watch() {
    std::unique_lock lock(mutex_);
    while (!stop_) {
        lock.unlock();
        look();
        lock.lock();
        stopping_.wait_for(lock, period_, [this] { return stop_ || soon_; });
        soon_ = false;
    }
}

void DaemonWatch::look() {
    auto sighting = std::make_shared<Sighting>();
    std::vector<Json> events;
    std::map<std::int64_t, std::uint64_t> seen;
    std::vector<std::int64_t> pids;
    try {
        for (const tools::MonitorClient& daemon : tools::connect_to_daemons(socket_)) {
            try {
                Json state = daemon.ask({{"verb", "state"}});
                const auto pid = state.at("daemon").at("pid").get<std::int64_t>();
                std::uint64_t& last = seen[pid] = seen_[pid];
                const Json answer = daemon.ask({{"verb", "events"}, {"after", last}});
                for (Json event : answer.at("events")) {
                    last = event.at("id").get<std::uint64_t>();
                    event["pid"] = pid;
                    events.push_back(std::move(event));
                }
                for (std::size_t k = 0; k < state.at("cameras").size(); ++k)
                    state["cameras"][k]["id"] = fmt::format("{}-{}", pid, k);
                sighting->states.push_back(std::move(state));
                pids.push_back(pid);
                if (visitor_ != nullptr) visitor_->visit(daemon, pid);
            } catch (const std::exception& error) { // has gone meanwhile, or is another version
                sighting->error = error.what();
            }
        }
    } catch (const Error& error) {
        sighting->error = error.what();
    }
    if (!sighting->states.empty()) sighting->error.clear();
    sighting->at = std::chrono::steady_clock::now();
    seen_ = std::move(seen);
    if (visitor_ != nullptr) visitor_->visited(pids);
    const std::lock_guard lock(mutex_);
    latest_ = std::move(sighting);
    for (Json& event : events) {
        event["id"] = ++last_id_;
        events_.push_back({last_id_, std::move(event)});
    }
    while (events_.size() > most_events)
        events_.pop_front();
}

} // namespace obscura::web
