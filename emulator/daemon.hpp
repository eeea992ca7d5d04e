// The daemon as an object: everything a configuration asks for, started in order and stopped in reverse.
#pragma once

#include "config/config.hpp"
#include "core/log.hpp"
#include "emulator/assemble.hpp"
#include "emulator/camera.hpp"
#include "emulator/releaser.hpp"
#include "emulator/timing_log.hpp"
#include "sync/sync.hpp"
#include "transports/transport.hpp"

#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Builds in the constructor, runs between start() and stop(). All members are called on the main thread.
class Daemon {
public:
    /// Loads and allocates; opens nothing. Throws Error.
    explicit Daemon(config::Config config);
    ~Daemon();
    Daemon(const Daemon&) = delete;
    Daemon& operator=(const Daemon&) = delete;

    /// Opens ports and files and starts to serve. Throws Error; then nothing is left running.
    void start();
    /// The mirror of start(), within 1 s.
    void stop();

    /// Where clients find the camera, "ADDRESS:PORT"; "none" without a control port. Valid after start().
    [[nodiscard]] std::string address() const;
    /// To be called several times a second: writes what real-time threads have logged.
    void tick();
    /// Takes on what `next` changes, if all of that can be changed while running; otherwise nothing, and the
    /// reason is the result. Frames in work are not disturbed. Throws Error when the new trigger source
    /// cannot be had; the old one goes on then.
    [[nodiscard]] std::string reload(config::Config next);
    /// From now on tick() appends the stamps of every frame to `out`, as CSV. `out` must outlive the daemon.
    void write_timing_to(std::ostream& out);
    /// False when a worker thread has made no progress on work in hand since the last call; call every second
    /// or slower.
    [[nodiscard]] bool alive();

    /// Counters in one line, for the log.
    [[nodiscard]] std::string summary() const;
    /// Counters and latencies as JSON.
    [[nodiscard]] std::string statistics_json() const;

    [[nodiscard]] Camera& camera() noexcept { return *camera_; }

private:
    config::Config config_;
    Priorities priorities_;
    LogRing log_;
    TimingLog timing_;
    std::ostream* timing_out_ = nullptr;
    std::unique_ptr<Imaging> imaging_;
    std::unique_ptr<Releaser> releaser_;
    std::unique_ptr<Camera> camera_;
    std::vector<std::unique_ptr<transports::Transport>> transports_;
    std::unique_ptr<sync::Conditioner> conditioner_;
    std::unique_ptr<sync::TriggerSource> source_;
    std::string address_ = "none";
    bool running_ = false;
};

} // namespace obscura::emulator
