// SPDX-License-Identifier: Apache-2.0
// Values of spectral bands from the planes of a texture.
#pragma once

#include "core/spectral_band.hpp"

#include <cstddef>
#include <vector>

namespace obscura::renderer {

class Texture;

/// Weights of a texture's planes in each spectral band: band x plane. One plane serves all bands; of as many
/// planes as bands each has its own; red, green and blue go to the bands by wavelength.
[[nodiscard]] std::vector<double> band_weights(const Texture& texture,
                                               const std::vector<SpectralBand>& bands);

/// Whether all bands have the same weights of `planes` planes.
[[nodiscard]] bool same_in_all_bands(const std::vector<double>& weights, std::size_t planes);

/// Value of a band from the planes of a texel, at least 0.
[[nodiscard]] inline double band_value(const std::vector<double>& weights, std::size_t band,
                                       const double* planes, std::size_t count) {
    double value = 0;
    for (std::size_t k = 0; k < count; ++k)
        value += weights[band * count + k] * planes[k];
    return value > 0 ? value : 0.0;
}

} // namespace obscura::renderer
