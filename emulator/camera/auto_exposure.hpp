// SPDX-License-Identifier: Apache-2.0
// SFNC ExposureAuto: exposure control from the digital numbers of earlier frames.
#pragma once

#include "core/camera/camera.hpp"
#include "core/camera/frame.hpp"

#include <atomic>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::emulator {

/// Histogram of digital numbers. Real-time safe but for the constructor.
class DnHistogram {
public:
    explicit DnHistogram(int bits) : counts_(std::size_t{1} << bits) {}

    void clear() noexcept;
    /// Counts pixels; numbers beyond the last bin count in the last bin.
    void add(std::span<const std::uint16_t> pixels) noexcept;
    [[nodiscard]] std::uint64_t pixels() const noexcept { return pixels_; }
    /// The smallest number that at least `percent` of the pixels do not exceed; 0 without pixels.
    [[nodiscard]] std::uint32_t percentile(double percent) const noexcept;

private:
    std::vector<std::uint32_t> counts_;
    std::uint64_t pixels_ = 0;
};

/// Measurement of one frame and limits of the control. Digital numbers and ns.
struct ExposureReading {
    double signal_dn = 0; ///< AutoExposure percentile of the first window
    double black_dn = 0, white_dn = 4095;
    double target_percent = 50;    ///< from black to white
    std::int64_t requested_ns = 0; ///< exposure requested for that frame
    std::int64_t obtained_ns = 0;  ///< after rounding and clipping by the chip
    std::int64_t min_ns = 0, max_ns = 0;
};

struct ExposureStep {
    std::int64_t exposure_ns = 0; ///< for the next frame
    bool settled = false;         ///< within the dead band, or at a limit
};

/// Next exposure of the control loop. The signal is proportional to the exposure, so the step is exposure
/// times goal over signal, limited to a factor of four. At full scale, and below 1/256 of the scale, the
/// signal is unknown: the factor is then a quarter, or four. Within 2 % of the goal, or if the limits allow
/// no step, the control has settled.
[[nodiscard]] ExposureStep next_exposure(const ExposureReading& reading) noexcept;

/// Reading of `frame`, made with `settings` within `limits`; `histogram` is that of its first window.
[[nodiscard]] ExposureReading exposure_reading(const Frame& frame, const DnHistogram& histogram,
                                               const CameraSettings& settings,
                                               const CameraLimits& limits) noexcept;

/// State of ExposureAuto: the exposure reached, and whether `once` has settled. One control thread restarts,
/// the pipeline thread adjusts. Lock-free and real-time safe.
class AutoExposure {
public:
    explicit AutoExposure(std::int64_t exposure_ns) noexcept { restart(exposure_ns); }

    /// Control side: begins a new run from `exposure_ns`. Frames of the run before no longer adjust.
    void restart(std::int64_t exposure_ns) noexcept;
    /// Any thread: exposure of the next frame, as far as it is known.
    [[nodiscard]] std::int64_t exposure_ns() const noexcept {
        return static_cast<std::int64_t>(word_.load(std::memory_order_acquire) & exposure_mask);
    }
    /// Any thread: `settings` as a client sees them, with the exposure reached; `once` reads `off` when
    /// settled.
    [[nodiscard]] CameraSettings shown(CameraSettings settings) const noexcept;

    // Pipeline thread.

    /// Samples the state for the next frame, for settings read at the same time.
    void sample() noexcept { frame_word_ = word_.load(std::memory_order_acquire); }
    /// Samples for settings read earlier: keeps the sample of their run if another run has begun since.
    void sample_same_run() noexcept;
    /// Exposure of the sample.
    [[nodiscard]] std::int64_t frame_exposure_ns() const noexcept {
        return static_cast<std::int64_t>(frame_word_ & exposure_mask);
    }
    /// True if a frame made with the sample adjusts the exposure under `mode`.
    [[nodiscard]] bool adjusts(ExposureAuto mode) const noexcept;
    /// Adjusts the exposure by the reading of a frame made with the sample.
    void adjust(const ExposureReading& reading, ExposureAuto mode) noexcept;

private:
    // One word, so that a frame of an earlier run cannot overwrite a restart: exposure, settled, run number.
    static constexpr std::uint64_t exposure_mask = (std::uint64_t{1} << 40) - 1;
    static constexpr std::uint64_t settled_bit = exposure_mask + 1;
    [[nodiscard]] static constexpr std::uint64_t run_of(std::uint64_t word) noexcept {
        return word / (2 * settled_bit);
    }

    std::atomic<std::uint64_t> word_{0};
    std::uint64_t frame_word_ = 0; ///< pipeline thread
};

} // namespace obscura::emulator
