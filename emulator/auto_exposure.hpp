// ExposureAuto: from the digital numbers of one frame to the exposure of the next.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

namespace obscura::emulator {

/// How often each digital number occurs. Only the constructor allocates.
class DnHistogram {
public:
    explicit DnHistogram(int bits) : counts_(std::size_t{1} << bits) {}

    void clear() noexcept;
    /// Numbers beyond the last bin count as the last.
    void add(std::span<const std::uint16_t> pixels) noexcept;
    [[nodiscard]] std::uint64_t pixels() const noexcept { return pixels_; }
    /// The least number that at least `percent` of the pixels do not exceed; 0 without pixels.
    [[nodiscard]] std::uint32_t percentile(double percent) const noexcept;

private:
    std::vector<std::uint32_t> counts_;
    std::uint64_t pixels_ = 0;
};

/// What one frame tells the controller, and what it may do. Digital numbers and ns.
struct ExposureReading {
    double signal_dn = 0; ///< the percentile
    double black_dn = 0, white_dn = 4095;
    double target_percent = 50;    ///< from black to white
    std::int64_t requested_ns = 0; ///< of that frame
    std::int64_t obtained_ns = 0;  ///< what the chip made of it
    std::int64_t min_ns = 0, max_ns = 0;
};

struct ExposureStep {
    std::int64_t exposure_ns = 0; ///< for the next frame
    bool settled = false;         ///< nothing is left to gain
};

/// The signal is proportional to the exposure, so one step leads to the goal: exposure times goal over
/// signal, but no more than a factor of four at a time. A full scale signal says only that it is too much,
/// one below 1/256 of the scale only that it is too little: then the factor is a quarter, or four. Within 2 %
/// of the goal, or where the limits allow no step, it has settled.
[[nodiscard]] ExposureStep next_exposure(const ExposureReading& reading) noexcept;

} // namespace obscura::emulator
