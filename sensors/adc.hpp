// SPDX-License-Identifier: Apache-2.0
// Analogue-to-digital converter transfer curve with INL and DNL.
#pragma once

#include "sensors/description.hpp"

#include <cstdint>
#include <vector>

namespace obscura::sensors {

/// Codes over the input range in steps of 1 / steps() DN. The code thresholds are those of an ideal
/// converter, distorted by two sinusoids (integral non-linearity, peak `adc_inl_dn`) and shifted one by one
/// (differential non-linearity: the code widths scatter with an rms of `adc_dnl_dn`, missing codes included).
/// Always monotonic. Drawn from the sensor's serial.
class AdcCurve {
public:
    explicit AdcCurve(const SensorDescription& description);

    [[nodiscard]] bool perfect() const noexcept { return codes_.empty(); }
    /// 2^bits * steps() codes and padding for kernels that read 32 bits at a time.
    [[nodiscard]] const std::uint16_t* codes() const noexcept { return codes_.data(); }
    [[nodiscard]] double steps() const noexcept { return steps_; }

private:
    std::vector<std::uint16_t> codes_;
    double steps_ = 8;
};

} // namespace obscura::sensors
