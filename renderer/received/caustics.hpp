// SPDX-License-Identifier: Apache-2.0
// Caustics: light of the Sun and the lamps by way of mirrors, as photons counted on patches.
#pragma once

#include "renderer/received/patch_scene.hpp"

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Light that ends on patches after one mirror or more. Counted on the patches as they are, without a kernel:
/// the only error is the photons' number on a patch.
struct Caustics {
    std::vector<float> power_w; ///< [patch of all bodies * bands + band]; empty: none
    std::vector<Push> pushes;   ///< on each PatchScene::bodies, of the light that ends there, body frame
    double landed_w = 0;        ///< power that ended on patches
    std::uint64_t rays = 0;
};

/// Shoots `photons` from each light at the bounding sphere of each mirror. `sun_w_m2`: at 1 au. `go_on` with
/// the number of photons shot; false ends it.
[[nodiscard]] Caustics shoot_photons(const PatchRays& rays, std::span<const double> sun_w_m2,
                                     std::uint64_t photons, std::uint64_t seed,
                                     const std::function<bool(std::uint64_t)>& go_on);

} // namespace obscura::renderer
