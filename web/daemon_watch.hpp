// SPDX-License-Identifier: Apache-2.0
// Watch over daemons: a thread that asks them several times a second and keeps what they said last.
#pragma once

#include <nlohmann/json.hpp>

#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <string>
#include <thread>
#include <vector>

namespace obscura::tools {
class MonitorClient;
}

namespace obscura::web {

/// What all daemons said at one time.
struct Sighting {
    /// Answers to "state", in the order of their sockets; each camera has also an `id`, "PID-N".
    std::vector<nlohmann::ordered_json> states;
    std::string error; ///< why there is none, else empty
    std::chrono::steady_clock::time_point at;
};

/// A line of a daemon's log.
struct WatchedEvent {
    std::uint64_t id = 0; ///< counts from 1 over all daemons since this watch began
    nlohmann::ordered_json event;
};

/// Asks daemons for more, on the thread of the watch.
class DaemonVisitor {
public:
    virtual ~DaemonVisitor() = default;
    /// Called with each daemon that has told its state.
    virtual void visit(const tools::MonitorClient& daemon, std::int64_t pid) = 0;
    /// Called after each look, with all of them.
    virtual void visited(std::span<const std::int64_t> pids) = 0;
};

/// However many ask this watch, the daemons are asked `period` apart. All members but the constructor are
/// thread-safe.
class DaemonWatch {
public:
    static constexpr std::size_t most_events = 4096; ///< that are kept

    /// `socket`: of one daemon; empty: all of this machine that this user may ask.
    /// `visitor` outlives this; null: none.
    DaemonWatch(std::string socket, std::chrono::milliseconds period, DaemonVisitor* visitor = nullptr);
    ~DaemonWatch();
    DaemonWatch(const DaemonWatch&) = delete;
    DaemonWatch& operator=(const DaemonWatch&) = delete;

    /// The last one; has an error before the first.
    [[nodiscard]] std::shared_ptr<const Sighting> latest() const;
    /// Events with ids above `after`, oldest first, at most `most`.
    [[nodiscard]] std::vector<WatchedEvent> events(std::uint64_t after, std::size_t most) const;

    /// Ends the pause before the next look.
    void look_soon();

private:
    void watch();
    void look();

    const std::string socket_;
    const std::chrono::milliseconds period_;
    DaemonVisitor* const visitor_;
    mutable std::mutex mutex_; ///< of what follows
    std::condition_variable stopping_;
    bool stop_ = false, soon_ = false;
    std::shared_ptr<const Sighting> latest_;
    std::deque<WatchedEvent> events_;
    std::uint64_t last_id_ = 0;
    std::map<std::int64_t, std::uint64_t> seen_; ///< last event of a daemon, by process; for the thread only
    std::thread thread_;                         ///< last, so that all else is there when it starts
};

} // namespace obscura::web
