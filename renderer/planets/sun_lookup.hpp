// SPDX-License-Identifier: Apache-2.0
// Filtered look-ups in kept visibility of the Sun, sixteen at a time.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/planets/sun_visibility.hpp"

#include <array>

namespace obscura::renderer {

/// Places in tiles of which the mean is wanted.
struct SunLookups {
    std::array<const SunTile*, packet_size> tile{}; ///< null: no look-up, and a mean of 0
    Doubles x, y;                                   ///< cells from the tile's corner
    Doubles width;                                  ///< cells
};

/// The means about the places over texels of about their widths: between the two nearest mip levels, by the
/// width over that of the finer one's texels, each interpolated between four texels. The same on all
/// machines.
void sun_means(const SunLookups& at, Vec3s& mean);

} // namespace obscura::renderer
