// One camera of the daemon and all that is its own: images, release of rows, transports.
#pragma once

#include "config/config.hpp"
#include "core/log.hpp"
#include "emulator/assemble.hpp"
#include "emulator/camera.hpp"
#include "emulator/releaser.hpp"
#include "emulator/timing_log.hpp"
#include "sync/ptp_monitor.hpp"
#include "transports/transport.hpp"

#include <iosfwd>
#include <memory>
#include <string>
#include <vector>

namespace obscura::emulator {

/// Triggers come from outside, through camera(). All members are called on the main thread.
class CameraUnit {
public:
    /// Loads and allocates; opens nothing. `log` and `ptp`, if any, must outlive the unit. Throws Error.
    CameraUnit(const config::Config& config, const Priorities& priorities, LogRing& log,
               const sync::PtpMonitor* ptp);
    ~CameraUnit();
    CameraUnit(const CameraUnit&) = delete;
    CameraUnit& operator=(const CameraUnit&) = delete;

    /// Starts the transports. Throws Error; stop() ends those that did start.
    void start();
    /// Acquires at once where nobody can ask for it, or where that is configured.
    void begin();
    void stop();

    /// "ADDRESS:PORT", "none" without a control port. Valid after start().
    [[nodiscard]] const std::string& address() const noexcept { return address_; }
    void tick();
    /// What the kernel does not know of TAI.
    void set_tai_correction_ns(std::int64_t ns) noexcept { imaging_->clock.set_tai_correction_ns(ns); }
    void write_timing_to(std::ostream& out);

    [[nodiscard]] std::string summary() const;
    [[nodiscard]] std::string statistics_json() const;
    [[nodiscard]] Camera& camera() noexcept { return *camera_; }
    [[nodiscard]] const Clock& clock() const noexcept { return imaging_->clock; }

private:
    const bool begins_at_once_;
    const int gige_port_;
    TimingLog timing_;
    std::ostream* timing_out_ = nullptr;
    std::unique_ptr<Imaging> imaging_;
    std::unique_ptr<Releaser> releaser_;
    std::unique_ptr<Camera> camera_;
    std::vector<std::unique_ptr<transports::Transport>> transports_;
    std::string address_ = "none";
};

} // namespace obscura::emulator
