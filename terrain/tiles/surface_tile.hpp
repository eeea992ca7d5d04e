// SPDX-License-Identifier: Apache-2.0
// Surface tile: heights of a square of vertices with a margin, and a pyramid of their maxima.
#pragma once

#include "terrain/surface_domain.hpp"

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

namespace obscura::terrain {

/// Levels of a tile's pyramid: level k holds maxima of 2^k x 2^k cells, 1 to pyramid_levels.
inline constexpr int pyramid_levels = 8;
inline constexpr std::size_t pyramid_size = (std::size_t{tile_cells} * tile_cells - 1) / 3;

/// Heights are reduced ones: of a point of an ellipsoid at distance r from its centre, the height times
/// SurfaceDomain::unit_m() / r, so that in space scaled by the radii the surface is at distance
/// 1 + height / unit_m. They are whole multiples of a power of two of metres that depends on the level alone:
/// vertices that tiles of a level share decode alike, bit for bit. Plain data, 350 KiB.
struct SurfaceTile {
    TileKey key;
    double offset_m = 0; ///< added to all heights and maxima
    double min_m = 0;    ///< the least height, offset included
    std::array<float, tile_vertices> heights;
    std::array<float, pyramid_size> maxima;
    float unused; ///< vector registers load pairs

    /// Vertex (i, j), -1 to tile_cells + 1 each.
    [[nodiscard]] const float* vertex(std::int32_t i, std::int32_t j) const {
        return heights.data() + (j + tile_margin) * tile_edge + i + tile_margin;
    }
    [[nodiscard]] double height_m(std::int32_t i, std::int32_t j) const {
        return offset_m + static_cast<double>(*vertex(i, j));
    }
    /// Place of a level's maxima.
    [[nodiscard]] static constexpr std::size_t pyramid_offset(int level) {
        // Levels are stored from the coarsest: 1 + 4 + 16 ...
        return ((std::size_t{1} << (2 * (pyramid_levels - level))) - 1) / 3;
    }
    /// Largest height of the cells [i, i + 1) x [j, j + 1) of 2^level cells each.
    [[nodiscard]] double maximum_m(int level, std::uint32_t i, std::uint32_t j) const {
        return offset_m +
               static_cast<double>(
                   maxima[pyramid_offset(level) + (std::size_t{j} << (pyramid_levels - level)) + i]);
    }
};

/// The unit that heights of a level are multiples of, m: 2^-14 of the spacing, rounded down to a power of
/// two.
[[nodiscard]] inline double height_step_m(const SurfaceDomain& domain, int level) {
    int exponent = 0;
    std::frexp(domain.spacing_m(level), &exponent);
    return std::ldexp(1.0, exponent - 1 - 14);
}

} // namespace obscura::terrain
