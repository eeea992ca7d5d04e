// SPDX-License-Identifier: Apache-2.0
// Lane-wise selection: copies of those lanes of a packet that a mask names.
#pragma once

#include "renderer/packets/packet.hpp"

namespace obscura::renderer {

/// Copies the lanes that are on in `which`; the others of `to` keep their values.
void copy_lanes(const Lanes& which, const Doubles& from, Doubles& to);

inline void copy_lanes(const Lanes& which, const Vec3s& from, Vec3s& to) {
    copy_lanes(which, from.x, to.x);
    copy_lanes(which, from.y, to.y);
    copy_lanes(which, from.z, to.z);
}

} // namespace obscura::renderer
