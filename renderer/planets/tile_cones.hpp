// SPDX-License-Identifier: Apache-2.0
// Cones over the ground of a tile that hold none of its surface: rays within them meet nothing in it.
#pragma once

#include "terrain/tiles/surface_tile.hpp"

#include <array>
#include <cstdint>

namespace obscura::renderer {

/// Each node of cone_cells x cone_cells cells has one.
inline constexpr int cone_level = 2;
inline constexpr std::uint32_t cone_cells = 1u << cone_level;
inline constexpr std::uint32_t cone_edge = terrain::tile_cells / cone_cells;

/// Bounds of the rise from any point of a node to any point of the tile: height over distance. A ray that is
/// above the surface and climbs faster meets nothing in the tile (cone stepping, Dummer 2006, with one bound
/// for all distances). Rows of cone_edge.
struct TileCones {
    std::array<float, std::size_t{cone_edge} * cone_edge> rise;
    float unused; ///< vector registers load pairs
};

/// `scale`: rise per metre and cell, at the place of the tile where cells are smallest.
void make_cones(const terrain::SurfaceTile& tile, double scale, TileCones& out);

} // namespace obscura::renderer
