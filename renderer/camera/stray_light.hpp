// SPDX-License-Identifier: Apache-2.0
// Stray light maps, added to the image.
#pragma once

#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// One map: what each pixel of the sensor gets. Immutable.
struct StrayMap {
    std::int32_t width = 0;
    std::vector<std::vector<double>> w_m2; ///< one plane for all bands, or one for each
    bool follows_sun = false;

    /// Adds row `y` from column `x` on to `light` (bands, one after the other); `sun`: irradiance of the Sun
    /// over that at 1 au.
    void add(std::int32_t x, std::int32_t y, double sun, std::size_t bands, std::span<double> light) const;
};

/// Reads the maps of a scene. Throws InputError; ConfigError if a map is not of the size of the sensor.
[[nodiscard]] std::vector<StrayMap> read_stray_light(const scene::Scene& scene);

} // namespace obscura::renderer
