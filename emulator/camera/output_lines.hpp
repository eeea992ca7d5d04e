// SPDX-License-Identifier: Apache-2.0
// GPIO output lines of the camera: TriggerReady and ExposureActive.
#pragma once

#include "core/clock.hpp"
#include "core/realtime/heartbeat.hpp"
#include "core/realtime/realtime.hpp"
#include "emulator/camera/camera.hpp"
#include "sync/inputs/gpio_output.hpp"

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <thread>

namespace obscura::emulator {

/// A thread of its own sets both lines at the instants of the readout plan, or as soon after as it is
/// scheduled. The exposure line is active from the first row's reset to the last row's readout (a short pulse
/// if the thread runs too late for that), the ready line while an edge would be accepted. A line that is lost
/// is opened again.
class OutputLines {
public:
    /// Opens a line; returns null if none is configured. Throws HardwareError.
    using Open = std::function<std::unique_ptr<sync::OutputLine>()>;

    /// `camera` and `clock` (CLOCK_MONOTONIC) must outlive this.
    OutputLines(Camera& camera, const Clock& clock, const ThreadSettings& thread, Open ready, Open exposure);
    ~OutputLines();
    OutputLines(const OutputLines&) = delete;
    OutputLines& operator=(const OutputLines&) = delete;

    /// Throws HardwareError.
    void start();
    void stop();
    [[nodiscard]] const Heartbeat& heartbeat() const noexcept { return heartbeat_; }
    /// Number of exposures signalled, and of losses of a line.
    [[nodiscard]] std::uint64_t exposures() const noexcept { return exposures_.load(); }
    [[nodiscard]] std::uint64_t lost() const noexcept { return lost_.load(); }

private:
    struct Line {
        const char* name;
        Open open;
        std::unique_ptr<sync::OutputLine> line{};
        bool active = false, wanted = false; ///< wanted: the line is configured
    };
    struct Exposure {
        Time start, end;
        bool shown = true;
    };

    void run();
    void show(Line& line, bool active);
    void reopen(Line& line, Time now);
    /// True if an exposure is active at `now`. Lowers `next` to the instant of the next change.
    [[nodiscard]] bool exposing(Time now, Time& next) const noexcept;

    Camera& camera_;
    const Clock& clock_;
    const ThreadSettings thread_settings_;
    Line ready_, exposure_;
    std::array<Exposure, 4> recent_{}; ///< exposures of the last frames, which may overlap
    Time next_try_{};
    std::atomic<bool> stopping_{false};
    std::atomic<std::uint64_t> exposures_{0}, lost_{0};
    Heartbeat heartbeat_{"output-lines"};
    std::thread thread_;
};

} // namespace obscura::emulator
