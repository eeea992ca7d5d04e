// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/lommel_seeliger.hpp"

#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(LommelSeeligerParameters& p) {
    return {config::key("albedo", &p.albedo)
                .range(0, 1)
                .required()
                .help("Single-scattering albedo of the grains, w; the normal albedo is w / 8")};
}

void LommelSeeliger::reflectance(const ScatterPacket& s, Doubles& r) const {
    const double scale = albedo_ * std::numbers::inv_pi / 4;
    for (int i = 0; i < packet_size; ++i)
        r[i] = s.cos_in[i] > 0 ? scale * s.cos_in[i] / (s.cos_in[i] + s.cos_out[i]) : 0.0;
}

} // namespace obscura::renderer
