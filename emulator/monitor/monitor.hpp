// SPDX-License-Identifier: Apache-2.0
// Monitor of a daemon: its state and events for programs of the same machine.
#pragma once

#include "config/keys.hpp"
#include "core/realtime/log_history.hpp"
#include "core/time.hpp"
#include "emulator/monitor/beat_times.hpp"
#include "emulator/monitor/recent_frames.hpp"
#include "service/call.hpp"

#include <nlohmann/json_fwd.hpp>

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace obscura::emulator {

class Daemon;

/// Fields of the call `events`.
struct EventRange {
    std::uint64_t after = 0, most = LogHistory::lines;

    [[nodiscard]] config::Keys keys();
};
/// Members of the answers to `state` and `events`.
[[nodiscard]] std::vector<service::Result> state_results();
[[nodiscard]] std::vector<service::Result> events_results();

/// Makes the answers to the calls `state` and `events`. It has no thread: the main thread, which is an
/// ordinary one and owns the daemon, calls tick() several times a second, and state() when a call has asked
/// for it; it reads counters that real-time threads write without locks. Thread-bound.
class Monitor {
public:
    /// `daemon` must outlive the monitor. `version` of the program. Opens nothing.
    Monitor(Daemon& daemon, std::string version);

    /// Path or address where programs call the daemon, for the answer to "state".
    void set_control(std::string address) { control_ = std::move(address); }
    /// When the program began to start, on the scheduling clock and in ns since 1970 UTC.
    void set_started(Time started, std::int64_t utc_ns) {
        started_ = started;
        started_utc_ns_ = utc_ns;
    }
    /// Takes a snapshot of the counters each second.
    void tick();

    /// The answer to `state`, see docs/control.md, but for the part of add_process(). Made once between two
    /// calls of tick(), however many ask.
    [[nodiscard]] std::shared_ptr<const nlohmann::ordered_json> state();
    /// Adds what the kernel knows of this process: its memory and its threads. Reads two files for each
    /// thread, so not on the main thread. Thread-safe.
    static void add_process(nlohmann::json& head);
    /// The answer to "events": log lines with ids above `after`, oldest first, at most `most`.
    /// Thread-safe.
    [[nodiscard]] static nlohmann::ordered_json events(std::uint64_t after, std::uint64_t most);

private:
    [[nodiscard]] nlohmann::ordered_json made_state() const;

    Daemon& daemon_;
    const std::string version_;
    Time started_;
    std::int64_t started_utc_ns_;      ///< tells this run from others of the same number
    std::string control_;              ///< empty: nowhere
    std::vector<RecentFrames> recent_; ///< of each camera
    BeatTimes beats_;
    std::vector<std::string> advice_; ///< see isolation_advice(); of the first tick()
    bool advised_ = false;
    std::shared_ptr<const nlohmann::ordered_json> state_; ///< since the last tick(); null: not made yet
};

} // namespace obscura::emulator
