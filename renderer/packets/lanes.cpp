// SPDX-License-Identifier: Apache-2.0
#include "renderer/packets/lanes.hpp"

namespace obscura::renderer {

OBSCURA_VECTOR_CLONES
void copy_lanes(const Lanes& which, const Doubles& from, Doubles& to) {
    for (int i = 0; i < packet_size; ++i)
        to.v[i] = which.on[i] != 0 ? from.v[i] : to.v[i];
}

} // namespace obscura::renderer
