// SPDX-License-Identifier: Apache-2.0
#include "renderer/textures/band_weights.hpp"

#include "renderer/lights/spectrum.hpp"
#include "renderer/textures/texture.hpp"

#include <algorithm>

namespace obscura::renderer {

std::vector<double> band_weights(const Texture& texture, const std::vector<SpectralBand>& bands) {
    const std::size_t planes = texture.planes();
    std::vector<double> w(bands.size() * planes, 0);
    for (std::size_t b = 0; b < bands.size(); ++b) {
        if (texture.rgb()) {
            const auto shares = colour_shares(bands[b]);
            std::copy(shares.begin(), shares.end(), w.begin() + static_cast<std::ptrdiff_t>(3 * b));
        } else {
            w[b * planes + (planes == 1 ? 0 : b)] = 1;
        }
    }
    return w;
}

bool same_in_all_bands(const std::vector<double>& weights, std::size_t planes) {
    bool same = true;
    for (std::size_t i = planes; i < weights.size(); ++i)
        same = same && weights[i] == weights[i % planes];
    return same;
}

} // namespace obscura::renderer
