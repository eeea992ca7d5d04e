// SPDX-License-Identifier: Apache-2.0
#include "web/live/daemon_watch.hpp"

#include "host/monitor_client.hpp"
#include "host/monitor_paths.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <exception>
#include <filesystem>
#include <random>
#include <utility>

namespace obscura::web {

using Json = nlohmann::ordered_json;

namespace {

/// Daemons that do not answer for a while are remembered, so that their events are not told twice.
constexpr std::size_t max_stored_replies = 64;

} // namespace

DaemonRun run_of(const Json& state) {
    const Json& daemon = state.at("daemon");
    return {daemon.at("pid").get<std::int64_t>(), daemon.value("started_utc_ns", std::string())};
}

DaemonWatch::DaemonWatch(std::string socket, std::chrono::milliseconds period, DaemonVisitor* visitor)
    : socket_(std::move(socket)),
      run_(fmt::format("{:08x}", std::random_device()())),
      period_(period),
      visitor_(visitor) {
    auto none = std::make_shared<Sighting>();
    none->error = "no daemon has been asked yet";
    none->at = std::chrono::steady_clock::now();
    latest_ = std::move(none);
    thread_ = std::thread([this] { find_daemons(); });
}

DaemonWatch::~DaemonWatch() {
    {
        const std::lock_guard lock(mutex_);
        stop_ = true;
    }
    changed_.notify_all();
    thread_.join();
}

std::shared_ptr<const Sighting> DaemonWatch::latest() const {
    const std::lock_guard lock(mutex_);
    return latest_;
}

std::vector<WatchedEvent> DaemonWatch::events(std::uint64_t after, std::size_t most) const {
    const std::lock_guard lock(mutex_);
    if (after > last_id_) after = 0;
    const auto first = std::upper_bound(events_.begin(), events_.end(), after,
                                        [](std::uint64_t id, const WatchedEvent& e) { return id < e.id; });
    const auto count = std::min<std::size_t>(most, static_cast<std::size_t>(events_.end() - first));
    return {first, first + static_cast<std::ptrdiff_t>(count)};
}

void DaemonWatch::look_soon() {
    {
        const std::lock_guard lock(mutex_);
        ++soon_;
    }
    changed_.notify_all();
}

void DaemonWatch::rest(std::uint64_t& answered) {
    std::unique_lock lock(mutex_);
    // Repeated requests for a poll must not overload the daemons.
    const auto pause = std::min(period_, shortest);
    changed_.wait_for(lock, pause, [this] { return stop_; });
    changed_.wait_for(lock, period_ - pause, [&] { return stop_ || soon_ != answered; });
    answered = soon_;
}

std::vector<std::string> DaemonWatch::sockets() const {
    if (!socket_.empty()) return {socket_};
    std::vector<std::string> paths;
    for (const std::filesystem::path& path : host::monitor_sockets())
        paths.push_back(path.string());
    return paths;
}

void DaemonWatch::find_daemons() {
    std::uint64_t answered = 0;
    bool has_searched = false;
    std::unique_lock lock(mutex_);
    while (!stop_) {
        bool all_told = has_searched;
        std::vector<std::thread> ended;
        std::vector<std::int64_t> pids;
        for (auto daemon = daemons_.begin(); daemon != daemons_.end();) {
            if (daemon->second.ended) {
                ended.push_back(std::move(daemon->second.thread));
                daemon = daemons_.erase(daemon);
            } else {
                if (!daemon->second.state.is_null())
                    pids.push_back(daemon->second.pid);
                else if (daemon->second.error.empty())
                    all_told = false;
                ++daemon;
            }
        }
        lock.unlock();
        for (std::thread& thread : ended)
            thread.join();
        if (visitor_ != nullptr && all_told) visitor_->visited(pids);
        std::string error;
        const std::vector<std::string> paths = sockets();
        for (const std::string& path : paths) {
            lock.lock();
            const bool known = daemons_.contains(path) || daemons_.size() >= max_daemons || stop_;
            lock.unlock();
            if (known) continue;
            if (const std::string refused = host::refusal_of_socket(path); !refused.empty()) {
                // Left over, or of another group.
                error = fmt::format("no daemon answers at {}: {}", path, refused);
                continue;
            }
            const std::lock_guard adding(mutex_);
            const auto daemon = daemons_.try_emplace(path).first;
            try {
                daemon->second.thread = std::thread([this, path] { watch(path); });
            } catch (const std::exception& refused) { // no thread is left
                daemons_.erase(daemon);
                error = refused.what();
            }
        }
        if (paths.empty()) error = host::no_daemon_here;
        has_searched = true;
        lock.lock();
        if (daemons_.empty()) publish(error);
        lock.unlock();
        rest(answered);
        lock.lock();
    }
    lock.unlock();
    for (auto& [path, daemon] : daemons_) // none are added any more
        daemon.thread.join();
}

void DaemonWatch::watch(const std::string& path) {
    std::uint64_t answered = 0;
    while (true) {
        std::string error;
        try {
            host::MonitorClient daemon(path); // its place is free for others until the next look
            look(path, daemon);
        } catch (const std::exception& refused) { // has gone meanwhile, or is another version
            error = refused.what();
        }
        const bool gone = !error.empty() && !host::refusal_of_socket(path).empty();
        if (!error.empty()) {
            const std::lock_guard lock(mutex_);
            Watched& own = daemons_.at(path);
            own.state = nullptr;
            own.error = error;
            own.ended = gone;
            publish(error);
        }
        if (gone) return;
        rest(answered);
        const std::lock_guard lock(mutex_);
        if (stop_) return;
    }
}

void DaemonWatch::look(const std::string& path, host::MonitorClient& daemon) {
    Json state = daemon.call("state").head;
    const DaemonRun run = run_of(state);
    std::uint64_t after = 0;
    {
        const std::lock_guard lock(mutex_);
        if (const auto seen = seen_.find(run); seen != seen_.end()) after = seen->second;
    }
    Json answer = daemon.call("events", {{"after", after}}).head;
    for (std::size_t k = 0; k < state.at("cameras").size(); ++k)
        state["cameras"][k]["id"] = fmt::format("{}-{}", run.pid, k);
    {
        const std::lock_guard lock(mutex_);
        take_events(std::move(answer.at("events")), run);
        Watched& own = daemons_.at(path);
        own.state = std::move(state);
        own.error.clear();
        own.pid = run.pid;
        publish({});
    }
    if (visitor_ != nullptr) visitor_->visit(daemon, run);
}

void DaemonWatch::take_events(Json events, const DaemonRun& run) {
    if (seen_.size() >= max_stored_replies && !seen_.contains(run))
        std::erase_if(seen_, [this](const auto& one) {
            return std::none_of(daemons_.begin(), daemons_.end(), [&one](const auto& daemon) {
                return !daemon.second.state.is_null() && daemon.second.pid == one.first.pid;
            });
        });
    std::uint64_t& seen = seen_[run];
    const auto add = [&](Json event) {
        event["id"] = ++last_id_;
        event["pid"] = run.pid;
        events_.push_back({last_id_, std::move(event)});
    };
    for (Json& event : events) {
        const auto id = event.at("id").get<std::uint64_t>();
        if (seen > 0 && id > seen + 1) // the daemon has not kept them until now
            add({{"utc", event.value("utc", std::string())},
                 {"level", "warning"},
                 {"text", fmt::format("{} lines of the log are lost here", id - seen - 1)},
                 {"message", ""}});
        seen = id;
        add(std::move(event));
    }
    while (events_.size() > max_events)
        events_.pop_front();
}

void DaemonWatch::publish(const std::string& error) {
    auto sighting = std::make_shared<Sighting>();
    for (const auto& [path, daemon] : daemons_)
        if (!daemon.state.is_null())
            sighting->states.push_back(daemon.state);
        else if (!daemon.error.empty() && !daemon.ended)
            sighting->silent.emplace(path, daemon.error);
    if (sighting->states.empty()) sighting->error = error.empty() ? latest_->error : error;
    sighting->at = std::chrono::steady_clock::now();
    latest_ = std::move(sighting);
}

} // namespace obscura::web
