// The daemon as an object: everything a configuration asks for, started in order and stopped in reverse.
#pragma once

#include "core/log.hpp"
#include "emulator/assemble.hpp"
#include "emulator/camera_unit.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/supervisor.hpp"
#include "emulator/thread_plan.hpp"
#include "sync/conditioner.hpp"
#include "sync/fan_out.hpp"
#include "sync/ptp_monitor.hpp"
#include "sync/sync.hpp"

#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// Builds in the constructor, runs between start() and stop(). All members are called on the main thread.
class Daemon {
public:
    /// Loads and allocates; opens nothing. Throws Error.
    explicit Daemon(emulator::DaemonConfig config);
    ~Daemon();
    Daemon(const Daemon&) = delete;
    Daemon& operator=(const Daemon&) = delete;

    /// Opens ports and files and starts to serve. Throws Error; then nothing is left running.
    void start();
    /// The mirror of start(), within 1 s.
    void stop();

    /// Where clients find the cameras, "ADDRESS:PORT" of each with blanks between; "none" for one without a
    /// control port. Valid after start().
    [[nodiscard]] std::string address() const;
    /// To be called several times a second: writes what real-time threads have logged.
    void tick();
    /// Takes on what `next` changes, if all of that can be changed while running; otherwise nothing, and the
    /// reason is the result. Frames in work are not disturbed; a scene is built while frames go on, and
    /// `meanwhile` is called several times a second during that. Throws Error when the new scene or trigger
    /// source cannot be had; the old one goes on then.
    [[nodiscard]] std::string reload(emulator::DaemonConfig next,
                                     const std::function<void()>& meanwhile = {});
    /// From now on tick() appends the stamps of every frame of that camera to `out`, as CSV. `out` must
    /// outlive the daemon.
    void write_timing_to(std::ostream& out, std::size_t camera = 0);
    /// True when every worker thread has given a sign of life since the last call that returned true; call
    /// several times a second until it does. A thread that is missed is logged once.
    [[nodiscard]] bool alive();

    /// Counters in one line, for the log.
    [[nodiscard]] std::string summary() const;
    /// Counters and latencies as JSON; of several cameras as a list "cameras" with the address of each.
    [[nodiscard]] std::string statistics_json() const;

    /// The highest priority that a thread of it takes; 0: none under SCHED_FIFO.
    [[nodiscard]] int realtime_priority() const noexcept { return highest_priority(threads_); }
    [[nodiscard]] std::size_t camera_count() const noexcept { return units_.size(); }
    [[nodiscard]] Camera& camera(std::size_t number = 0) noexcept { return units_.at(number)->camera(); }

private:
    /// A trigger source and the cameras that it reaches.
    struct TriggerLine {
        std::size_t number = 0; ///< what cameras call it: Line0 and so on
        std::size_t config = 0; ///< camera whose configuration describes it
        std::vector<CameraUnit*> units;
        sync::FanOut cameras;
        std::unique_ptr<sync::Conditioner> conditioner;
        std::unique_ptr<sync::TriggerSource> source; ///< none: software triggers only
        ClockState clock = ClockState::free;         ///< as it was logged last

        [[nodiscard]] ClockState clock_state() const;
        [[nodiscard]] std::string_view source_name() const { return source ? source->name() : "none"; }
        /// Line0: where simulators of its cameras make steps, with the source or nowhere.
        void let_step(bool with_source) const;
    };

    void wire(std::size_t number, const std::vector<const emulator::DaemonConfig*>& cameras);
    void publish_clock_states();
    void replace_trigger(TriggerLine& line, const emulator::DaemonConfig& camera);
    [[nodiscard]] std::string statistics_of(std::size_t unit) const;

    emulator::DaemonConfig config_;
    ThreadPlan threads_;
    Supervisor supervisor_;
    Time last_alive_;
    bool silence_reported_ = false;
    LogRing log_;
    std::unique_ptr<sync::PtpMonitor> ptp_; ///< outlives the cameras, which ask it
    std::vector<std::unique_ptr<CameraUnit>> units_;
    std::vector<std::unique_ptr<TriggerLine>> lines_; ///< go before the cameras that they reach
    bool running_ = false;
};

} // namespace obscura::emulator
