// SPDX-License-Identifier: Apache-2.0
#include "renderer/materials/mirror.hpp"

namespace obscura::renderer {

scene::ParameterList declare(MirrorParameters& p) {
    return {config::key("reflectance", &p.reflectance)
                .range(0, 1)
                .help("Fraction of the light that the mirror reflects")};
}

void Mirror::reflectance(const ScatterPacket& /*s*/, Doubles& r) const {
    for (int i = 0; i < packet_size; ++i)
        r[i] = 0;
}

} // namespace obscura::renderer
