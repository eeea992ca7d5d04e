// SPDX-License-Identifier: Apache-2.0
// Temperature dependence of dark current and reset (kTC) noise.
#pragma once

#include "sensors/description.hpp"

namespace obscura::sensors {

/// Dark current at `temperature_c` relative to that at `reference_c`, by the law that the settings select.
///
/// doubling: 2^((T - T_ref) / dT), EMVA 1288 release 4, section 7.2.
/// band_gap: T^1.5 exp(-E_g / 2 k T) with E_g = 1.1557 - 7.021e-4 T^2 / (T + 1108) eV, M. Konnik and J.
/// Welsh, arXiv:1412.4031, eqs. 15 and 16.
[[nodiscard]] double dark_current_ratio(const DetectorSettings& settings, double temperature_c,
                                        double reference_c);

/// Rms reset noise on the sense node, electrons: sqrt(k T C) / q with C = q / conversion gain; a soft reset
/// has half the variance (B. Pain et al., Analysis and enhancement of low-light-level performance of
/// photodiode-type CMOS active pixel imagers, 1999). 0 if no conversion gain is given.
[[nodiscard]] double reset_noise_e(const DetectorSettings& settings);

} // namespace obscura::sensors
