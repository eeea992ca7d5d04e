// SPDX-License-Identifier: Apache-2.0
// Spectral bands: transmission, irradiance of the Sun, weights of red, green and blue.
#pragma once

#include "renderer/scene/scene.hpp"

#include <array>
#include <vector>

namespace obscura::renderer {

/// Transmission of a band at a wavelength inside it, 0 to 1.
[[nodiscard]] double transmission(const SpectralBand& band, double wavelength_m);

/// The Sun's irradiance at 1 au in a band, W/m2 (ASTM E490-00a).
[[nodiscard]] double sun_irradiance_w_m2(const SpectralBand& band);

/// Mean of a reflectance over the sunlight in a band: curve times transmission times the Sun's spectrum, over
/// the same without the curve. The curve, of one point or more, is linear between its points and constant
/// outside. Without sunlight in the band (beyond 200 nm to 4 um) by the transmission alone.
[[nodiscard]] double sunlit_mean(const std::vector<SpectralPoint>& curve, const SpectralBand& band);

/// Weights of red, green and blue (reflectances at 650, 550 and 450 nm) in a band: linear between them by the
/// middle wavelength of the band, constant outside.
[[nodiscard]] std::array<double, 3> colour_shares(const SpectralBand& band);

} // namespace obscura::renderer
