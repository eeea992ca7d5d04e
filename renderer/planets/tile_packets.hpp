// SPDX-License-Identifier: Apache-2.0
// Rays of a packet in the tiles of a terrain, several at once in vector registers.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/planets/tile_walk.hpp"

#include <cstdint>

namespace obscura::renderer {

/// Rays of a packet, each in one tile, structure of arrays. A ray goes from node to node of the tile's
/// pyramid of maxima: over those that it is above of, and down into the others, until it meets the bilinear
/// patch of a cell or is through. No lane's result depends on another lane, on the width of the registers or
/// on the instruction set: IEEE operations only, no fused ones.
struct alignas(64) TileLanes {
    enum State : std::int64_t {
        off = 0,     ///< or through: not met in this tile
        running = 1, ///< to be traced from `x` to `to`, in the node (i, j) of width `max_width`
        met = 2,     ///< at `x`, in the cell (i, j)
        grazing = 3, ///< from `x` to `exit`, the cell (i, j) is met near the least height above it, if at all
        passed = 4,  ///< that cell was not met: to be traced on from `exit`
    };
    Doubles x, to, exit;
    WalkLines lines;
    /// Sphere: squares of the closest distance and of the speed. Plane: height at x = 0 and its derivative.
    Doubles miss2, speed2;
    Doubles offset_m, half_cells, first_i, first_j; ///< of the tile; numbers of its first cells on the face
    Doubles highest, least;                         ///< unit heights of the tile's vertices
    Doubles width, max_width;                       ///< of the node in cells, now and at most
    Doubles i, j;                                   ///< node, counted in its widths
    alignas(64) std::int64_t vertices[packet_size]; ///< address of vertex (0, 0)
    alignas(64) std::int64_t maxima[packet_size];   ///< address of the pyramid
    alignas(64) std::int64_t cones[packet_size];    ///< address of TileCones::rise
    alignas(64) std::int64_t node[packet_size];     ///< the tile's own number: not used here
    alignas(64) std::int64_t state[packet_size];
    Doubles s, r; ///< of met lanes: place in the cell, 0 to 1
};

/// What lanes take over of a tile: see TileLanes.
struct TileSource {
    double offset_m, half_cells, first_i, first_j, highest, least;
    std::int64_t vertices, maxima, cones, node;
};

/// Lanes, a bit each.
struct TileOutcome {
    std::uint32_t met, grazing;
};

/// Lets the lanes (a bit each) run in a node of a tile: from parts.from to parts.to or `best`. With `all`,
/// the others are off in that tile.
void enter_tile(std::uint32_t lanes, bool all, const TileSource& tile, const WalkParts& parts,
                const Doubles& best, double width, double i, double j, TileLanes& to);

/// Traces the running lanes until each is off, met or grazing. `per_m`: unit heights per metre. Without
/// `roots`, `x` of met lanes is anywhere in the cell up to the crossing, and `s` and `r` are not set.
[[nodiscard]] TileOutcome trace_tile_lanes(TileLanes& lanes, double per_m, bool plane, bool roots);

} // namespace obscura::renderer
