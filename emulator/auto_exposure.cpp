#include "emulator/auto_exposure.hpp"

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
    // From what was obtained: where the chip sets limits of its own, the request does not run away.
    const double base = static_cast<double>(r.obtained_ns > 0 ? r.obtained_ns : r.requested_ns);
    const std::int64_t next = std::clamp<std::int64_t>(std::llround(base * factor), r.min_ns, r.max_ns);
    return {next, next == r.requested_ns};
}

} // namespace obscura::emulator
