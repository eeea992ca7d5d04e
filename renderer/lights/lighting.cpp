// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/lighting.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace obscura::renderer {

bool Lighting::has_sun() const {
    return std::any_of(sun_w_m2.begin(), sun_w_m2.end(), [](double e) { return e > 0; });
}

Lighting make_lighting(const scene::Scene& scene, std::vector<AreaLight> area_lights,
                       std::vector<double> sun_w_m2, std::uint32_t max_bounces) {
    Lighting lighting;
    lighting.sun_w_m2 = std::move(sun_w_m2);
    lighting.lamps = scene.lamps;
    lighting.area_lights = std::move(area_lights);
    lighting.max_bounces = max_bounces;
    lighting.products = std::make_shared<ColourProducts>(scene, max_bounces);
    for (const AreaLight& light : lighting.area_lights)
        lighting.area_m2 += light.area_m2;
    return lighting;
}

double beam_share(const scene::Lamp& lamp, double cos_angle) {
    const double angle = std::acos(std::clamp(cos_angle, -1.0, 1.0));
    switch (lamp.beam) {
    case scene::Lamp::Beam::uniform:
        return angle <= lamp.half_angle_rad ? 1 : 0;
    case scene::Lamp::Beam::gaussian: {
        const double x = angle / lamp.half_angle_rad;
        return std::exp(-2 * x * x);
    }
    case scene::Lamp::Beam::point:
        break;
    }
    return 1;
}

} // namespace obscura::renderer
