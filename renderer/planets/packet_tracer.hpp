// SPDX-License-Identifier: Apache-2.0
// First crossings of the rays of a packet with a terrain of tiles.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/planets/tile_tracer.hpp"

#include <array>

namespace obscura::renderer {

/// Rays in the scaled space of a terrain.
struct ScaledRays {
    Vec3s origin, direction;
    Doubles t_max;
    Lanes active;
    std::array<LevelChoice, packet_size> levels; ///< of the active lanes
};

/// Finds for each active lane what TileTracer::first_crossing() finds, up to rounding. With `any`, whether
/// there is a crossing counts alone: rays whose origins are below the surface count as blocked there.
/// The caller holds a SurfaceTiles::Pin.
void first_crossings(const SurfaceTiles& tiles, const ScaledRays& rays, bool any,
                     std::array<TileCrossing, packet_size>& found);

} // namespace obscura::renderer
