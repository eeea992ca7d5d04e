// SPDX-License-Identifier: Apache-2.0
#include "emulator/camera/auto_exposure.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::emulator {

void DnHistogram::clear() noexcept {
    std::fill(counts_.begin(), counts_.end(), 0U);
    pixels_ = 0;
}

void DnHistogram::add(std::span<const std::uint16_t> pixels) noexcept {
    const std::size_t last = counts_.size() - 1;
    for (const std::uint16_t dn : pixels)
        ++counts_[std::min<std::size_t>(dn, last)];
    pixels_ += pixels.size();
}

std::uint32_t DnHistogram::percentile(double percent) const noexcept {
    const double wanted = percent / 100 * static_cast<double>(pixels_);
    std::uint64_t below = 0;
    for (std::size_t dn = 0; dn < counts_.size(); ++dn) {
        below += counts_[dn];
        if (below > 0 && static_cast<double>(below) >= wanted) return static_cast<std::uint32_t>(dn);
    }
    return 0;
}

ExposureStep next_exposure(const ExposureReading& r) noexcept {
    constexpr double step_max = 4, dead_band = 0.02, darkest = 1.0 / 256;
    const double span = r.white_dn - r.black_dn;
    const double signal = r.signal_dn - r.black_dn;
    const double goal = r.target_percent / 100 * span;
    const double factor = r.signal_dn >= r.white_dn  ? 1 / step_max
                          : signal <= darkest * span ? step_max
                                                     : std::clamp(goal / signal, 1 / step_max, step_max);
    if (std::abs(factor - 1) <= dead_band) return {r.requested_ns, true};
    // Step from the obtained exposure, so that the request does not wind up where the chip clips it.
    const double base = static_cast<double>(r.obtained_ns > 0 ? r.obtained_ns : r.requested_ns);
    const std::int64_t next = std::clamp<std::int64_t>(std::llround(base * factor), r.min_ns, r.max_ns);
    return {next, next == r.requested_ns};
}

ExposureReading exposure_reading(const Frame& frame, const DnHistogram& histogram,
                                 const CameraSettings& settings, const CameraLimits& limits) noexcept {
    ExposureReading reading;
    reading.signal_dn = histogram.percentile(settings.auto_percentile);
    reading.black_dn = settings.black_level_dn;
    reading.white_dn = std::exp2(frame.info.bits_per_pixel) - 1;
    reading.target_percent = settings.auto_target_percent;
    reading.requested_ns = frame.info.exposure_ns;
    reading.obtained_ns = frame.info.windows[0].exposure_max_ns;
    reading.min_ns = limits.exposure_min_ns;
    reading.max_ns = limits.exposure_max_ns;
    return reading;
}

void AutoExposure::restart(std::int64_t exposure_ns) noexcept {
    const std::uint64_t run = run_of(word_.load(std::memory_order_relaxed)) + 1;
    word_.store(run * 2 * settled_bit + static_cast<std::uint64_t>(exposure_ns), std::memory_order_release);
}

CameraSettings AutoExposure::shown(CameraSettings settings) const noexcept {
    if (settings.exposure_auto == ExposureAuto::off) return settings;
    const std::uint64_t word = word_.load(std::memory_order_acquire);
    settings.exposure_ns = static_cast<std::int64_t>(word & exposure_mask);
    if (settings.exposure_auto == ExposureAuto::once && (word & settled_bit) != 0)
        settings.exposure_auto = ExposureAuto::off;
    return settings;
}

void AutoExposure::sample_same_run() noexcept {
    const std::uint64_t word = word_.load(std::memory_order_acquire);
    if (run_of(word) == run_of(frame_word_)) frame_word_ = word;
}

bool AutoExposure::adjusts(ExposureAuto mode) const noexcept {
    return mode == ExposureAuto::continuous ||
           (mode == ExposureAuto::once && (frame_word_ & settled_bit) == 0);
}

void AutoExposure::adjust(const ExposureReading& reading, ExposureAuto mode) noexcept {
    const ExposureStep step = next_exposure(reading);
    const std::uint64_t settled = mode == ExposureAuto::once && step.settled ? settled_bit : 0;
    std::uint64_t expected = frame_word_;
    const std::uint64_t next =
        (expected & ~exposure_mask) | settled | static_cast<std::uint64_t>(step.exposure_ns);
    // The exchange fails after a restart by the control side: this frame's reading is then obsolete.
    word_.compare_exchange_strong(expected, next, std::memory_order_acq_rel);
}

} // namespace obscura::emulator
