// SPDX-License-Identifier: Apache-2.0
// Direct irradiance: light of the Sun and the lamps on the patches of a body.
#pragma once

#include "renderer/received/patch_scene.hpp"

#include <cstdint>
#include <vector>

namespace obscura::renderer {

/// Direct light on a body. By patch; with bands [patch * bands + band].
struct DirectIrradiance {
    std::vector<double> area_m2; ///< of the points: what sums are weighed by
    std::vector<double> sun;     ///< irradiance per irradiance of the Sun at 1 au
    std::size_t channels = 1;    ///< bands of a spectral law; of others one counts for all
    /// Share of it that is reflected, before the factor: [patch * channels + channel].
    std::vector<double> sun_share;
    std::vector<double> lit_share;
    std::vector<double> lamps, lamps_reflected; ///< W/m2; empty: no lamps
    Push push;                                  ///< of the light and its first reflection, N and N m
    std::uint64_t rays = 0;

    [[nodiscard]] double reflected_share(std::size_t patch, std::size_t band) const {
        return sun_share[patch * channels + (channels > 1 ? band : 0)];
    }
};

/// Gathers it from `points` points of each patch. `sun_w_m2`: irradiance at 1 au in each band.
[[nodiscard]] DirectIrradiance gather_direct(const PatchRays& rays, const PatchBody& body,
                                             std::span<const double> sun_w_m2, std::uint32_t points,
                                             std::uint64_t seed);

} // namespace obscura::renderer
