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
    const DetailView* view = nullptr; ///< LevelChoice::view of all lanes
    Doubles reach;                    ///< LevelChoice::reach, with a view
    int fixed_level = 0;              ///< of all lanes, without one

    [[nodiscard]] LevelChoice levels(int i) const { return {view, view ? reach[i] : 0, fixed_level}; }
};

/// Crossings of the rays of a packet: see TileCrossing.
struct TileCrossings {
    Doubles t, s, r; ///< t: no_hit where there is none, and then nothing else is set
    std::array<const SurfaceNode*, packet_size> node;
    std::array<std::uint32_t, packet_size> cell;

    void set(int i, const TileCrossing& crossing) {
        t[i] = crossing.t;
        s[i] = crossing.s;
        r[i] = crossing.r;
        node[static_cast<std::size_t>(i)] = crossing.node;
        cell[static_cast<std::size_t>(i)] = crossing.cell;
    }
};

/// Finds for each active lane what TileTracer::first_crossing() finds, up to rounding. With `any`, whether
/// there is a crossing counts alone: rays whose origins are below the surface count as blocked there,
/// and t alone is set.
/// The caller holds a SurfaceTiles::Pin.
void first_crossings(const SurfaceTiles& tiles, const ScaledRays& rays, bool any, TileCrossings& found);

} // namespace obscura::renderer
