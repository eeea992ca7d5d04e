// SPDX-License-Identifier: Apache-2.0
// Packets of vectors: transformation between frames, filling.
#pragma once

#include "renderer/packets/packet.hpp"

namespace obscura::renderer {

/// out = m in + offset, lane by lane.
void transform(const Mat3& m, const Vec3s& in, Vec3 offset, Vec3s& out);

/// Directions m in + beta as unit vectors, and the lengths that they had, lane by lane.
void transform_tilted(const Mat3& m, const Vec3s& in, Vec3 beta, Vec3s& out, Doubles& stretch);

/// Sets all lanes to `value`.
inline void set_all(Vec3s& packet, Vec3 value) {
    for (int i = 0; i < packet_size; ++i) {
        packet.x.v[i] = value.x;
        packet.y.v[i] = value.y;
        packet.z.v[i] = value.z;
    }
}

} // namespace obscura::renderer
