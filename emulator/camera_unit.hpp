// One camera of the daemon and all that is its own: images, release of rows, transports.
#pragma once

#include "core/log.hpp"
#include "emulator/assemble.hpp"
#include "emulator/camera.hpp"
#include "emulator/config/daemon_config.hpp"
#include "emulator/output_lines.hpp"
#include "emulator/releaser.hpp"
#include "emulator/simulator_server.hpp"
#include "emulator/thread_plan.hpp"
#include "emulator/timing_log.hpp"
#include "sync/ptp_monitor.hpp"
#include "transports/transport.hpp"

#include <cstdint>
#include <functional>
#include <iosfwd>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::emulator {

/// Triggers come from outside, through camera(). All members are called on the main thread.
class CameraUnit {
public:
    /// Loads and allocates; opens nothing. `log` and `ptp`, if any, must outlive the unit. Throws Error.
    CameraUnit(const emulator::DaemonConfig& config, const ThreadPlan& threads, LogRing& log,
               const sync::PtpMonitor* ptp);
    ~CameraUnit();
    CameraUnit(const CameraUnit&) = delete;
    CameraUnit& operator=(const CameraUnit&) = delete;

    /// Starts the transports. Throws Error; stop() ends those that did start.
    void start();
    /// Acquires at once where nobody can ask for it, or where that is configured.
    void begin();
    void stop();

    /// Steps of this camera's simulator go to `source` from now on; null: nowhere.
    void step_with(sync::SoftwareTrigger* source);
    /// First half of a reload, which may fail: a scene that differs is built, while frames go on and
    /// `meanwhile` is called several times a second. The reason why that cannot be, or nothing. Throws Error.
    [[nodiscard]] std::string prepare(const emulator::DaemonConfig& next,
                                      const std::function<void()>& meanwhile);
    /// Second half, which cannot: scene and late policy change from the next frame on.
    void take_on(const emulator::DaemonConfig& next);
    /// Forgets what prepare() built.
    void dismiss() { next_renderer_.reset(); }

    /// "ADDRESS:PORT" of the transport that serves the control port; "none" without a control port. Valid
    /// after start().
    [[nodiscard]] const std::string& address() const noexcept { return address_; }
    void tick();
    /// What the kernel does not know of TAI.
    void set_tai_correction_ns(std::int64_t ns) noexcept { imaging_->clock.set_tai_correction_ns(ns); }
    void write_timing_to(std::ostream& out);

    [[nodiscard]] std::string summary() const;
    [[nodiscard]] std::string statistics_json(ClockState clock, std::string_view source) const;
    /// Of all threads but those that rendering is made of.
    [[nodiscard]] Heartbeats heartbeats() const;
    [[nodiscard]] Camera& camera() noexcept { return *camera_; }
    [[nodiscard]] const Clock& clock() const noexcept { return imaging_->clock; }

private:
    const bool begins_at_once_;
    const ThreadPlan threads_;
    TimingLog timing_;
    std::ostream* timing_out_ = nullptr;
    bool stopped_ = false;
    std::unique_ptr<Imaging> imaging_;
    std::uint64_t scene_fingerprint_ = 0, next_fingerprint_ = 0;
    std::unique_ptr<renderer::Renderer> next_renderer_;        ///< between prepare() and take_on()
    std::vector<std::unique_ptr<renderer::Renderer>> retired_; ///< until frames are made without them
    std::unique_ptr<Releaser> releaser_;
    std::unique_ptr<Camera> camera_;
    std::vector<std::unique_ptr<transports::Transport>> transports_;
    std::unique_ptr<SimulatorServer> simulator_;
    std::unique_ptr<OutputLines> outputs_;
    std::string address_ = "none";
};

} // namespace obscura::emulator
