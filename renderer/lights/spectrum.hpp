// SPDX-License-Identifier: Apache-2.0
// Spectral bands: transmission, irradiance of the Sun and of stars, weights of red, green and blue.
#pragma once

#include "renderer/scene/scene.hpp"

#include <array>

namespace obscura::renderer {

/// Transmission of a band at a wavelength inside it, 0 to 1.
[[nodiscard]] double transmission(const SpectralBand& band, double wavelength_m);

/// The Sun's irradiance at 1 au in a band, W/m2 (ASTM E490-00a).
[[nodiscard]] double sun_irradiance_w_m2(const SpectralBand& band);

/// Weights of red, green and blue (reflectances at 650, 550 and 450 nm) in a band: linear between them by the
/// middle wavelength of the band, constant outside.
[[nodiscard]] std::array<double, 3> colour_shares(const SpectralBand& band);

/// Effective temperature of a star from its colour, K. Ballesteros, New insights into black bodies, EPL 97,
/// 34008 (2012), eq. 14; B-V is clamped to -0.4 .. 2.5.
[[nodiscard]] double colour_temperature_k(double colour_b_v);

/// Irradiance of a star in a band, W/m2: black body of its colour temperature, scaled to 3.63e-8 W m-2 um-1 x
/// 10^(-0.4 V) at 545 nm, the effective wavelength of V (Bessell, Castelli, Plez, A&A 333, 231 (1998), table
/// A2: 363.1e-11 erg cm-2 s-1 A-1 for V = 0).
[[nodiscard]] double star_irradiance_w_m2(double magnitude_v, double colour_b_v, const SpectralBand& band);

} // namespace obscura::renderer
