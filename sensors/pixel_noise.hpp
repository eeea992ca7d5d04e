// SPDX-License-Identifier: Apache-2.0
// Temporal noise of a pixel of mean response by its signal.
#pragma once

#include "sensors/description.hpp"

namespace obscura::sensors {

/// Noise of a pixel in one destructive read, electrons. Row noise and RTS noise, which pixels share or few
/// have, are not in it.
struct PixelNoise {
    double dark_e_per_s = 0; ///< dark current at the sensor's temperature
    double readout_e = 0;    ///< rms of amplifier, reset and the rounding of the ADC

    /// Variance for `signal_e` expected electrons of light, integrated for `exposure_s`.
    [[nodiscard]] double variance_e2(double signal_e, double exposure_s) const noexcept {
        return signal_e + dark_e_per_s * exposure_s + readout_e * readout_e;
    }
};

[[nodiscard]] PixelNoise pixel_noise(const DetectorSettings& settings, double gain_db) noexcept;

} // namespace obscura::sensors
