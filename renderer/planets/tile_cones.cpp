// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/tile_cones.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <vector>

namespace obscura::renderer {
namespace {

using terrain::SurfaceTile;
using terrain::tile_cells;

using Grid = std::vector<float>;

/// Largest of each value and those beside it towards a quadrant.
Grid towards(unsigned quadrant, const Grid& of, std::size_t edge) {
    const auto next = [&](std::size_t k, bool up) {
        return up ? std::min(k + 1, edge - 1) : k - (k > 0 ? 1 : 0);
    };
    Grid result(of.size());
    for (std::size_t j = 0; j < edge; ++j) {
        const float* const row = of.data() + j * edge;
        const float* const beside = of.data() + next(j, (quadrant & 2) != 0) * edge;
        for (std::size_t i = 0; i < edge; ++i) {
            const std::size_t ahead = next(i, (quadrant & 1) != 0);
            result[j * edge + i] = std::max(std::max(row[i], row[ahead]), std::max(beside[i], beside[ahead]));
        }
    }
    return result;
}

std::uint8_t code_of(double rise) {
    if (!(rise >= 0x1p-12)) return 0;
    const std::int64_t step = (std::bit_cast<std::int64_t>(rise) >> rise_shift) - rise_base;
    return static_cast<std::uint8_t>(std::min<std::int64_t>(step + 1, steepest_rise));
}

} // namespace

void make_cones(const SurfaceTile& tile, double scale, TileCones& out) {
    // Steepest cell towards each quadrant and least height of each node.
    const Grid nothing(out.rise.size(), 0);
    std::array<Grid, 4> steepest{nothing, nothing, nothing, nothing};
    Grid least(out.rise.size(), std::numeric_limits<float>::infinity());
    for (std::int32_t j = 0; j < tile_cells; ++j) {
        const float *const low = tile.vertex(0, j), *const high = tile.vertex(0, j + 1);
        const std::size_t row = static_cast<std::size_t>(j) / cone_cells * cone_edge;
        for (std::size_t i = 0; i < tile_cells; ++i) {
            const float a = low[i], b = low[i + 1], c = high[i], d = high[i + 1];
            const std::array<float, 2> u{std::max({a - b, c - d, 0.0F}), std::max({b - a, d - c, 0.0F})},
                v{std::max({a - c, b - d, 0.0F}), std::max({c - a, d - b, 0.0F})};
            const std::size_t k = row + i / cone_cells;
            for (std::size_t q = 0; q < steepest.size(); ++q)
                steepest[q][k] = std::max(steepest[q][k], u[q & 1] * u[q & 1] + v[q >> 1] * v[q >> 1]);
            least[k] = std::min(least[k], std::min(std::min(a, b), std::min(c, d)));
        }
    }
    // Far more than what rounding takes.
    const double factor = scale * (1 + 1e-5);
    for (unsigned quadrant = 0; quadrant < steepest.size(); ++quadrant) {
        std::array<std::vector<double>, std::tuple_size_v<TileCones::Rings>> rise;
        for (std::vector<double>& ring : rise)
            ring.resize(out.rise.size());
        // Up to the nodes beside it, no faster than the steepest of their cells.
        const Grid beside = towards(quadrant, steepest[quadrant], cone_edge);
        for (std::size_t k = 0; k < beside.size(); ++k)
            rise[0][k] = std::sqrt(static_cast<double>(beside[k]));
        // Beyond the nodes of a level that are beside it, to those of the next one.
        std::size_t ring = 1;
        for (int level = cone_level + 1; level < terrain::pyramid_levels; ++level) {
            const std::size_t edge = static_cast<std::size_t>(tile_cells) >> level;
            const float* const first = tile.maxima.data() + SurfaceTile::pyramid_offset(level);
            const Grid highest = towards(quadrant, Grid(first, first + edge * edge), edge);
            const double per_cell = std::ldexp(1.0, 1 - level);
            const int finer = level - cone_level;
            for (std::size_t j = 0; j < cone_edge; ++j)
                for (std::size_t i = 0; i < cone_edge; ++i) {
                    const std::size_t k = j * cone_edge + i;
                    const double up = static_cast<double>(highest[(j >> finer) * edge + (i >> finer)]) -
                                      static_cast<double>(least[k]);
                    rise[ring][k] = std::max(rise[ring][k], up * per_cell);
                }
            if (ring < cone_rings.size() && level == cone_rings[ring]) ++ring;
        }
        for (std::size_t k = 0; k < out.rise.size(); ++k)
            for (std::size_t r = 0; r < rise.size(); ++r)
                out.rise[k][quadrant][r] = code_of(rise[r][k] * factor + 1e-9);
    }
    out.unused = {};
}

} // namespace obscura::renderer
