// SPDX-License-Identifier: Apache-2.0
#include "sensors/pixel_noise.hpp"

#include "sensors/dark_current.hpp"

#include <cmath>

namespace obscura::sensors {

PixelNoise pixel_noise(const DetectorSettings& s, double gain_db) noexcept {
    const double dn_per_e = s.gain_dn_per_e * std::pow(10, gain_db / 20);
    const double reset_e = reset_noise_e(s);
    const double samples = s.double_sampling ? 2 : 1;
    return {s.dark_current_e_per_s * dark_current_ratio(s, s.temperature_c, s.dark_reference_c),
            std::sqrt(samples * (s.read_noise_e * s.read_noise_e + reset_e * reset_e) +
                      1 / (12 * dn_per_e * dn_per_e))};
}

} // namespace obscura::sensors
