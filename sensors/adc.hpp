// The transfer curve of an imperfect analogue-to-digital converter.
#pragma once

#include "sensors/description.hpp"

#include <cstdint>
#include <vector>

namespace obscura::sensors {

/// Codes over the input range in steps of 1 / steps() DN. The thresholds are those of a perfect converter,
/// bent by two sinusoids (integral non-linearity, peak `adc_inl_dn`) and shifted one by one (differential
/// non-linearity: the widths of the codes scatter with an rms of `adc_dnl_dn`, missing codes included).
/// Always monotonic. Drawn from the sensor's serial.
class AdcCurve {
public:
    explicit AdcCurve(const SensorDescription& description);

    [[nodiscard]] bool perfect() const noexcept { return codes_.empty(); }
    /// 2^bits * steps() codes and one more, for kernels that read 32 bits at a time.
    [[nodiscard]] const std::uint16_t* codes() const noexcept { return codes_.data(); }
    [[nodiscard]] double steps() const noexcept { return steps_; }

private:
    std::vector<std::uint16_t> codes_;
    double steps_ = 8;
};

} // namespace obscura::sensors
