// SPDX-License-Identifier: Apache-2.0
// Watch over daemons: threads that ask them several times a second and keep what they said last.
#pragma once

#include <nlohmann/json.hpp>

#include <chrono>
#include <compare>
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

namespace obscura::host {
class MonitorClient;
}

namespace obscura::web {

/// What each daemon said last.
struct Sighting {
    /// Answers to "state", in the order of their sockets; each camera has also an `id`, "PID-N".
    std::vector<nlohmann::ordered_json> states;
    std::map<std::string, std::string> silent; ///< sockets that take connections and do not answer; why
    std::string error;                         ///< why there is no state, else empty
    std::chrono::steady_clock::time_point at;  ///< of the answer that came last
};

/// A run of a daemon. Its process may have the number of the one before, as in containers.
struct DaemonRun {
    std::int64_t pid = 0;
    std::string started; ///< differs from run to run
    auto operator<=>(const DaemonRun&) const = default;
};
/// Run named by an answer to "state". Throws an exception of JSON.
[[nodiscard]] DaemonRun run_of(const nlohmann::ordered_json& state);

/// A line of a daemon's log.
struct WatchedEvent {
    std::uint64_t id = 0; ///< counts from 1 over all daemons since this watch began
    nlohmann::ordered_json event;
};

/// Asks daemons for more, on the threads of the watch: of each daemon one, and one that looks for daemons.
class DaemonVisitor {
public:
    virtual ~DaemonVisitor() = default;
    /// Called with each daemon that has told its state.
    virtual void visit(host::MonitorClient& daemon, const DaemonRun& run) = 0;
    /// Called again and again with those that answer, unless one that has just been found may still do so.
    virtual void visited(std::span<const std::int64_t> pids) = 0;
};

/// However many ask this watch, the daemons are asked `period` apart, or `shortest` where look_soon() is
/// called. Each daemon has a thread, so that one that does not answer, which is waited for for 5 s, holds up
/// no other. All members but the constructor are thread-safe.
class DaemonWatch {
public:
    static constexpr std::size_t max_daemons = 16;  ///< that are watched
    static constexpr std::size_t max_events = 4096; ///< that are kept
    static constexpr std::chrono::milliseconds shortest{100};

    /// `socket`: of one daemon; empty: all of this machine that this user may ask.
    /// `visitor` outlives this; null: none.
    DaemonWatch(std::string socket, std::chrono::milliseconds period, DaemonVisitor* visitor = nullptr);
    ~DaemonWatch();
    DaemonWatch(const DaemonWatch&) = delete;
    DaemonWatch& operator=(const DaemonWatch&) = delete;

    /// The last one; has an error before the first.
    [[nodiscard]] std::shared_ptr<const Sighting> latest() const;
    /// Events with ids above `after`, oldest first, at most `most`. An id that has not been given yet is of
    /// another run: all events are later than that.
    [[nodiscard]] std::vector<WatchedEvent> events(std::uint64_t after, std::size_t most) const;

    /// Differs from run to run of this program, in which ids of events begin anew.
    [[nodiscard]] const std::string& run() const noexcept { return run_; }

    /// Ends the pause before the next look.
    void look_soon();

private:
    /// A daemon whose socket took a connection.
    struct Watched {
        nlohmann::ordered_json state; ///< null: none
        std::string error;            ///< why there is none; empty: it has just been found
        std::int64_t pid = 0;         ///< of that state
        bool ended = false;           ///< its thread is about to end: nothing serves the socket
        std::thread thread;
    };

    void find_daemons();
    void watch(const std::string& path);
    void look(const std::string& path, host::MonitorClient& daemon);
    /// Until the next look; `answered` counts calls of look_soon() before the last one.
    void rest(std::uint64_t& answered);
    [[nodiscard]] std::vector<std::string> sockets() const;
    /// With mutex_ locked.
    void publish(const std::string& error);
    void take_events(nlohmann::ordered_json events, const DaemonRun& run);

    const std::string socket_, run_;
    const std::chrono::milliseconds period_;
    DaemonVisitor* const visitor_;
    mutable std::mutex mutex_; ///< of what follows
    std::condition_variable changed_;
    bool stop_ = false;
    std::uint64_t soon_ = 0; ///< calls of look_soon()
    std::shared_ptr<const Sighting> latest_;
    std::deque<WatchedEvent> events_;
    std::uint64_t last_id_ = 0;
    std::map<std::string, Watched> daemons_;  ///< by socket
    std::map<DaemonRun, std::uint64_t> seen_; ///< id of the last event of each
    std::thread thread_;                      ///< last, so that all else is there when it starts
};

} // namespace obscura::web
