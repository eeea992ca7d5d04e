// SPDX-License-Identifier: Apache-2.0
// Light sources of a scene as the path tracer samples them: the Sun, lamps and emitting bodies.
#pragma once

#include "renderer/lights/colour_products.hpp"
#include "renderer/scene/scene.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace obscura::renderer {

/// An emitting body whose surface can be sampled by area.
struct AreaLight {
    std::int32_t body = 0; ///< index among the built bodies
    double area_m2 = 0;
};

/// Light sources, and the largest number of reflections of their light; the same for all rows.
struct Lighting {
    std::vector<double> sun_w_m2; ///< irradiance per band at 1 au; all 0: no Sun
    std::vector<scene::Lamp> lamps;
    std::vector<AreaLight> area_lights;
    double area_m2 = 0; ///< sum over `area_lights`
    std::uint32_t max_bounces = 0;
    std::shared_ptr<const ColourProducts> products = std::make_shared<ColourProducts>(); ///< never null

    [[nodiscard]] bool has_sun() const;
};

/// Collects the light sources of a scene; `sun_w_m2`: see Lighting.
[[nodiscard]] Lighting make_lighting(const scene::Scene& scene, std::vector<AreaLight> area_lights,
                                     std::vector<double> sun_w_m2, std::uint32_t max_bounces);

/// Intensity of a lamp at an angle to its axis, relative to that on the axis.
[[nodiscard]] double beam_share(const scene::Lamp& lamp, double cos_angle);

} // namespace obscura::renderer
