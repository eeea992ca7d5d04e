// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/lambert.hpp"

#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(LambertParameters& p) {
    return {
        config::key("albedo", &p.albedo)
            .range(0, 1)
            .required()
            .help(
                "Hemispherical reflectance of the surface, which is the normal albedo and the Bond albedo too")};
}

void Lambert::reflectance(const ScatterPacket& s, Doubles& r) const {
    const double scale = albedo_ * std::numbers::inv_pi;
    for (int i = 0; i < packet_size; ++i)
        r[i] = s.cos_in[i] > 0 ? scale * s.cos_in[i] : 0.0;
}

} // namespace obscura::renderer
