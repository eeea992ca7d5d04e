// SPDX-License-Identifier: Apache-2.0
// Spectral bands: weight of wavelengths, irradiance of the Sun, weights of red, green and blue.
#pragma once

#include "renderer/scene/scene.hpp"

#include <array>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Value at a wavelength of a curve of one point or more: linear between its points and constant outside.
[[nodiscard]] double curve_value(std::span<const SpectralPoint> curve, double wavelength_m);

/// Weight of light of a wavelength inside a band: its response, or else its transmission, 0 to 1.
[[nodiscard]] double band_weight(const SpectralBand& band, double wavelength_m);
/// The curve of that weight; empty: 1.
[[nodiscard]] const std::vector<SpectralPoint>& weights_of(const SpectralBand& band);
/// Mean of the weight over the band.
[[nodiscard]] double mean_weight(const SpectralBand& band);
/// Integral of a relative spectrum, per wavelength, times the weight over the band; curve as curve_value().
[[nodiscard]] double curve_light(std::span<const SpectralPoint> spectrum, const SpectralBand& band);

/// The Sun's irradiance at 1 au in a band, W/m2 (ASTM E490-00a).
[[nodiscard]] double sun_irradiance_w_m2(const SpectralBand& band);

/// Mean of a reflectance over the sunlight in a band: curve times weight times the Sun's spectrum, over
/// the same without the curve. The curve, of one point or more, is linear between its points and constant
/// outside. Without sunlight in the band (beyond 200 nm to 4 um) by the weight alone.
[[nodiscard]] double sunlit_mean(const std::vector<SpectralPoint>& curve, const SpectralBand& band);

/// Weights of red, green and blue (reflectances at 650, 550 and 450 nm) in a band: linear between them by the
/// middle wavelength of the band, constant outside.
[[nodiscard]] std::array<double, 3> colour_shares(const SpectralBand& band);

} // namespace obscura::renderer
