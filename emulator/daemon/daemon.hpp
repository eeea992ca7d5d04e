// SPDX-License-Identifier: Apache-2.0
// The daemon as an object: cameras, trigger sources and threads of a configuration, started in order and
// stopped in reverse.
#pragma once

#include "core/realtime/log.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/daemon/supervisor.hpp"
#include "emulator/daemon/tai_reference.hpp"
#include "emulator/unit/assemble.hpp"
#include "emulator/unit/camera_unit.hpp"
#include "emulator/unit/thread_plan.hpp"
#include "sync/conditioner.hpp"
#include "sync/fan_out.hpp"
#include "sync/ptp_monitor.hpp"
#include "sync/sync.hpp"

#include <nlohmann/json_fwd.hpp>

#include <cstddef>
#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// Builds in the constructor, runs between start() and stop(). Thread-bound to the main thread.
class Daemon {
public:
    /// Loads files and allocates; opens no device or socket. Throws Error.
    explicit Daemon(emulator::DaemonConfig config);
    ~Daemon();
    Daemon(const Daemon&) = delete;
    Daemon& operator=(const Daemon&) = delete;

    /// Makes the tiles of terrains that the first frames need, on threads of ordinary priority; before
    /// start(). `go_on` is called several times a second with the share that is done; false ends it. Returns
    /// whether it is done. Throws Error.
    bool load_tiles(const GoOn& go_on);
    /// Opens ports and files and starts to serve. Throws Error; nothing is left running then.
    void start();
    /// Stops in reverse order of start(), within 1 s.
    void stop();

    /// Control addresses of the cameras, "ADDRESS:PORT" of each separated by blanks; "none" for a camera
    /// without a control port. Valid after start().
    [[nodiscard]] std::string address() const;
    /// "ADDRESS:PORT" of the client that controls a camera; empty: none. Between start() and stop().
    [[nodiscard]] std::string controller(std::size_t camera) const { return units_.at(camera)->controller(); }
    /// Control address of a camera, "none" without a control port. Valid after start().
    [[nodiscard]] const std::string& address(std::size_t camera) const {
        return units_.at(camera)->address();
    }
    /// Writes the messages of real-time threads to the log; to be called several times a second.
    void tick();
    /// Applies the changes of `next` if all of them are reloadable; otherwise changes nothing and returns the
    /// reason. Frames in progress are not disturbed; a scene is built while frames continue, and `meanwhile`
    /// is called several times a second during that, and ends it by returning false. Throws Error if the new
    /// scene or trigger source is not usable; the old one stays in use.
    [[nodiscard]] std::string reload(emulator::DaemonConfig next,
                                     const std::function<bool()>& meanwhile = {});
    /// Takes control of all cameras away from their clients.
    void release_control();
    /// Makes tick() append the time stamps of every further frame of that camera to `file`, as CSV. Throws
    /// OutputError.
    void write_timing_to(const std::filesystem::path& file, std::size_t camera = 0);
    /// Frames of all cameras whose row in those files is missing.
    [[nodiscard]] std::uint64_t lost_timing_rows() const noexcept;
    /// True if every thread has beaten since the last call that returned true; to be called several times a
    /// second until it does. A thread without heartbeat is logged once.
    [[nodiscard]] bool alive();

    /// Counters in one line, for the log.
    [[nodiscard]] std::string summary() const;
    /// Log messages of real-time threads that found no room.
    [[nodiscard]] std::uint64_t lost_messages() const noexcept { return log_.lost(); }
    /// Counters and latencies of one camera, see statistics_json().
    [[nodiscard]] nlohmann::ordered_json statistics_of(std::size_t camera) const;
    /// Counters and latencies as JSON text; for several cameras a list "cameras" with the address of each.
    [[nodiscard]] std::string statistics_json() const;

    /// Scheduling of its threads, as granted.
    [[nodiscard]] const ThreadPlan& threads() const noexcept { return threads_; }
    [[nodiscard]] std::size_t camera_count() const noexcept { return units_.size(); }
    [[nodiscard]] Camera& camera(std::size_t number = 0) noexcept { return units_.at(number)->camera(); }
    [[nodiscard]] CameraUnit& unit(std::size_t number) noexcept { return *units_.at(number); }
    /// Configuration in use.
    [[nodiscard]] const emulator::DaemonConfig& config() const noexcept { return config_; }
    /// configuration_sha256() of it. Thread-safe.
    [[nodiscard]] std::string config_sha256() const;
    /// When it was taken on, in s since 1970 UTC.
    [[nodiscard]] double configured_utc_s() const noexcept { return configured_utc_s_; }
    /// What ptp4l says of this machine's clock; none: ptp.enabled is off.
    [[nodiscard]] std::optional<PtpStatus> ptp_status() const;
    /// Heartbeats of all threads except the pipelines'. Between start() and stop().
    [[nodiscard]] Heartbeats heartbeats() const;

private:
    /// A trigger source and the cameras connected to it.
    struct TriggerLine {
        std::size_t number = 0; ///< line number of the cameras: 0 is Line0
        std::size_t config = 0; ///< camera whose configuration defines it
        std::vector<CameraUnit*> units;
        sync::FanOut cameras;
        std::unique_ptr<sync::Conditioner> conditioner;
        std::unique_ptr<sync::TriggerSource> source; ///< null: software triggers only
        ClockState clock = ClockState::free;         ///< state logged last
        bool refusal_logged = false;

        [[nodiscard]] ClockState clock_state() const;
        [[nodiscard]] std::string_view source_name() const { return source ? source->name() : "none"; }
        /// Whether simulators step its cameras.
        [[nodiscard]] bool lockstep() const;
        [[nodiscard]] std::uint64_t refused() const { return source ? source->refused() : 0; }
        /// See SourceState::offset_ns.
        [[nodiscard]] std::optional<std::int64_t> offset_ns() const;
        /// Connects the simulators of its cameras to the source for steps, or disconnects them (Line0 only).
        void let_step(bool with_source) const;
    };

    void wire(std::size_t number, const std::vector<const emulator::DaemonConfig*>& cameras);
    void publish_clock_states();
    void report_refused_triggers();
    void replace_trigger(TriggerLine& line, const emulator::DaemonConfig& camera);
    /// Notes and logs that `config_` is in use from now on.
    void note_configuration();

    emulator::DaemonConfig config_;
    mutable std::mutex sha256_mutex_;
    std::string config_sha256_;
    double configured_utc_s_ = 0;
    ThreadPlan threads_;
    Supervisor supervisor_;
    Time last_alive_;
    bool silence_reported_ = false;
    LogRing log_;
    TaiReference tai_;
    std::unique_ptr<sync::PtpMonitor> ptp_; ///< outlives the cameras, which ask it
    std::vector<std::unique_ptr<CameraUnit>> units_;
    std::vector<std::unique_ptr<TriggerLine>> lines_; ///< destroyed before the cameras they are connected to
    bool running_ = false;
};

} // namespace obscura::emulator
