// SPDX-License-Identifier: Apache-2.0
// Square part of a tile's grid and the sphere that holds it, to pass over features that do not reach it.
#pragma once

#include "core/geometry.hpp"
#include "terrain/surface_domain.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>

namespace obscura::terrain {

/// Columns and rows count from the margin.
struct GridBlock {
    int i0, i1, j0, j1; ///< columns and rows of the grid, the last ones not included
    Vec3 centre_m;
    double radius_m = 0;

    GridBlock(std::span<const Vec3> positions_m, int i, int j, int edge)
        : i0(i), i1(std::min(i + edge, tile_edge)), j0(j), j1(std::min(j + edge, tile_edge)) {
        centre_m = positions_m[index((i0 + i1) / 2, (j0 + j1) / 2)];
        double square = 0;
        for (int row = j0; row < j1; ++row)
            for (int column = i0; column < i1; ++column)
                square = std::max(square, length_squared(positions_m[index(column, row)] - centre_m));
        radius_m = std::sqrt(square);
    }
    [[nodiscard]] static std::size_t index(int column, int row) {
        return static_cast<std::size_t>(row) * tile_edge + static_cast<std::size_t>(column);
    }
    [[nodiscard]] bool touches(Vec3 centre, double reach_m) const {
        const double limit = reach_m + radius_m;
        return length_squared(centre - centre_m) <= limit * limit;
    }
};

} // namespace obscura::terrain
