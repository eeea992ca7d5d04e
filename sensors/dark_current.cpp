// SPDX-License-Identifier: Apache-2.0
#include "sensors/dark_current.hpp"

#include <cmath>

namespace obscura::sensors {
namespace {

constexpr double zero_celsius_k = 273.15;
constexpr double boltzmann_j_k = 1.380649e-23;
constexpr double charge_c = 1.602176634e-19;

double band_gap_current(double temperature_c) {
    const double t = temperature_c + zero_celsius_k;
    const double gap_ev = 1.1557 - 7.021e-4 * t * t / (t + 1108);
    return std::pow(t, 1.5) * std::exp(-gap_ev * charge_c / (2 * boltzmann_j_k * t));
}

} // namespace

double dark_current_ratio(const DetectorSettings& settings, double temperature_c, double reference_c) {
    if (settings.dark_law == DarkLaw::band_gap)
        return band_gap_current(temperature_c) / band_gap_current(reference_c);
    return std::exp2((temperature_c - reference_c) / settings.dark_doubling_k);
}

double reset_noise_e(const DetectorSettings& settings) {
    if (!(settings.conversion_gain_v_per_e > 0)) return 0;
    const double capacitance_f = charge_c / settings.conversion_gain_v_per_e;
    const double variance_c2 = boltzmann_j_k * (settings.temperature_c + zero_celsius_k) * capacitance_f;
    const double share = settings.reset_mode == ResetMode::soft ? 0.5 : 1;
    return std::sqrt(share * variance_c2) / charge_c;
}

} // namespace obscura::sensors
