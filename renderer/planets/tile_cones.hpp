// SPDX-License-Identifier: Apache-2.0
// Cones over the ground of a tile that hold none of its surface: rays within them meet nothing in it.
#pragma once

#include "terrain/tiles/surface_tile.hpp"

#include <array>
#include <cstdint>

namespace obscura::renderer {

/// Each node of cone_cells x cone_cells cells has one.
inline constexpr int cone_level = 3;
inline constexpr std::uint32_t cone_cells = 1u << cone_level;
inline constexpr std::uint32_t cone_edge = terrain::tile_cells / cone_cells;

/// Rings about a node in a quadrant end where the nodes beside it, of these levels, do; the last one is the
/// rest of the tile there.
inline constexpr std::array<int, 3> cone_rings{cone_level, cone_level + 1, cone_level + 3};

/// Rises, height over distance, as a byte: the lower edge of the step k is that of doubles whose upper bits
/// (rise_shift) are rise_base + k, 2^-12 for 0, with 16 steps to a factor of two. A rise that has the code k
/// is below that edge; of the code steepest_rise it may be anything.
inline constexpr int rise_shift = 48;
inline constexpr std::int64_t rise_base = std::int64_t{1023 - 12} << 4;
inline constexpr int steepest_rise = 255;

/// Bounds of the rise from any point of a node to any point of the tile that is in one of its rings, in the
/// quadrant from the former: bit 0, u grows, bit 1, v grows. A ray that is above the surface and climbs as
/// fast meets nothing there (cone stepping, Dummer 2006).
struct TileCones {
    using Rings = std::array<std::uint8_t, 4>;

    std::array<std::array<Rings, 4>, std::size_t{cone_edge} * cone_edge> rise; ///< rows of cone_edge
    Rings unused; ///< vector registers load pairs
};

/// `scale`: rise per metre and cell, at the place of the tile where cells are smallest.
void make_cones(const terrain::SurfaceTile& tile, double scale, TileCones& out);

} // namespace obscura::renderer
