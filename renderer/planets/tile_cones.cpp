// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/tile_cones.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace obscura::renderer {
namespace {

using terrain::SurfaceTile;
using terrain::tile_cells;

using Grid = std::vector<float>;

/// Largest of each value and its eight neighbours.
Grid around(const Grid& of, std::uint32_t edge) {
    Grid rows(of.size()), result(of.size());
    for (std::size_t j = 0; j < edge; ++j)
        for (std::size_t i = 0; i < edge; ++i) {
            const float* const row = of.data() + j * edge;
            rows[j * edge + i] =
                std::max({row[i > 0 ? i - 1 : 0], row[i], row[std::min<std::size_t>(i + 1, edge - 1)]});
        }
    for (std::size_t j = 0; j < edge; ++j)
        for (std::size_t i = 0; i < edge; ++i)
            result[j * edge + i] = std::max({rows[(j > 0 ? j - 1 : 0) * edge + i], rows[j * edge + i],
                                             rows[std::min<std::size_t>(j + 1, edge - 1) * edge + i]});
    return result;
}

} // namespace

void make_cones(const SurfaceTile& tile, double scale, TileCones& out) {
    // Steepest cell and least height of each node.
    Grid steepest(out.rise.size(), 0), least(out.rise.size(), std::numeric_limits<float>::infinity());
    for (std::int32_t j = 0; j < tile_cells; ++j) {
        const float *const low = tile.vertex(0, j), *const high = tile.vertex(0, j + 1);
        const std::size_t row = static_cast<std::size_t>(j) / cone_cells * cone_edge;
        for (std::size_t i = 0; i < tile_cells; ++i) {
            const float a = low[i], b = low[i + 1], c = high[i], d = high[i + 1];
            const float u = std::max(std::abs(b - a), std::abs(d - c)),
                        v = std::max(std::abs(c - a), std::abs(d - b));
            float& square = steepest[row + i / cone_cells];
            square = std::max(square, u * u + v * v);
            float& bottom = least[row + i / cone_cells];
            bottom = std::min(bottom, std::min(std::min(a, b), std::min(c, d)));
        }
    }
    // Up to the nodes beside it, no faster than the steepest of their cells.
    const Grid beside = around(steepest, cone_edge);
    std::vector<double> rise(out.rise.size());
    for (std::size_t k = 0; k < rise.size(); ++k)
        rise[k] = std::sqrt(static_cast<double>(beside[k]));
    // Beyond the nodes of a level that are beside it, to those of the next one.
    for (int level = cone_level + 1; level < terrain::pyramid_levels; ++level) {
        const std::uint32_t edge = static_cast<std::uint32_t>(tile_cells) >> level;
        const float* const first = tile.maxima.data() + SurfaceTile::pyramid_offset(level);
        const Grid highest = around(Grid(first, first + std::size_t{edge} * edge), edge);
        const double per_cell = std::ldexp(1.0, 1 - level);
        const int finer = level - cone_level;
        for (std::size_t j = 0; j < cone_edge; ++j)
            for (std::size_t i = 0; i < cone_edge; ++i) {
                const std::size_t k = j * cone_edge + i;
                const double up = static_cast<double>(highest[(j >> finer) * edge + (i >> finer)]) -
                                  static_cast<double>(least[k]);
                rise[k] = std::max(rise[k], up * per_cell);
            }
    }
    // Far more than what rounding takes.
    for (std::size_t k = 0; k < rise.size(); ++k)
        out.rise[k] = static_cast<float>(rise[k] * scale * (1 + 1e-5) + 1e-9);
    out.unused = 0;
}

} // namespace obscura::renderer
