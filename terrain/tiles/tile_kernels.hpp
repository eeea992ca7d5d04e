// SPDX-License-Identifier: Apache-2.0
// Rows of a surface tile, vertices side by side in vector registers.
#pragma once

#include "terrain/surface_domain.hpp"

#include <array>
#include <cstddef>

namespace obscura::terrain {

/// A row of a tile with its margin, whole registers of it.
inline constexpr std::size_t tile_row_size = (tile_edge + 7) / 8 * 8;
using TileRow = std::array<double, tile_row_size>;

/// Points of the ellipsoid at (u, v) of a face, |v| <= 1, and the factor from heights to reduced ones; the
/// points are those of SurfaceDomain::point(), bit for bit, where |u| <= 1.
void make_row_points(const SurfaceDomain& domain, std::uint8_t face, const TileRow& u, double v, Vec3* points,
                     double* reductions);

/// Heights of a tile on their way into it.
struct TileHeights {
    double step = 1;               ///< a power of two, of which all become multiples
    double least = 0, largest = 0; ///< bounds, which all are brought into
};
/// What became of them.
struct QuantizedRange {
    double least = 0, largest = 0;
    std::size_t outside =
        0; ///< heights beyond the bounds by more than the step, and those that are no numbers
};
/// Multiplies heights by `reductions` (null: not) and rounds them. What is no number becomes the least
/// height.
[[nodiscard]] QuantizedRange quantize(const TileHeights& to, double* heights, const double* reductions,
                                      std::size_t count);
/// Subtracts the offset.
void store_heights(const double* heights, double offset, std::size_t count, float* out);
/// Maxima of 2 x 2 cells from three rows of vertices.
void make_row_maxima(const float* first, const float* second, const float* third, float* maxima);

} // namespace obscura::terrain
