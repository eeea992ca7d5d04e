// SPDX-License-Identifier: Apache-2.0
#include "terrain/maps/cubic_bounds.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>

namespace obscura::terrain {
namespace {

using Four = std::array<double, 4>;

/// Weights that make the Bezier points of the part [from, to] of a cell of its four samples: points are
/// blossoms of the cubic.
std::array<Four, 4> bezier_weights(double from, double to) {
    // Samples to Bezier points of the whole cell.
    constexpr double s = 1.0 / 6;
    constexpr std::array<Four, 4> whole{{{0, 1, 0, 0}, {-s, 1, s, 0}, {0, s, 1, -s}, {0, 0, 1, 0}}};
    const auto blossom = [](double a, double b, double c) {
        // De Casteljau's algorithm with a different place at each step, on the unit vectors.
        Four weights{};
        for (std::size_t k = 0; k < 4; ++k) {
            Four p{};
            p[k] = 1;
            for (const double t : {a, b, c})
                for (std::size_t n = 0; n < 3; ++n)
                    p[n] = (1 - t) * p[n] + t * p[n + 1];
            weights[k] = p[0];
        }
        return weights;
    };
    const std::array<Four, 4> of_whole{blossom(from, from, from), blossom(from, from, to),
                                       blossom(from, to, to), blossom(to, to, to)};
    std::array<Four, 4> weights{};
    for (std::size_t n = 0; n < 4; ++n)
        for (std::size_t k = 0; k < 4; ++k)
            for (std::size_t i = 0; i < 4; ++i)
                weights[n][i] += of_whole[n][k] * whole[k][i];
    return weights;
}

/// Part of the cell at `cell` that lies in [from, to].
std::array<Four, 4> weights_in(int cell, double from, double to) {
    return bezier_weights(std::max(from - cell, 0.0), std::min(to - cell, 1.0));
}

} // namespace

CubicBounds cubic_bounds(std::span<const float> samples, int columns, const PlaceRectangle& part) {
    CubicBounds bounds{std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity()};
    const auto last_cell = [](double to, int first) {
        return std::max(first, static_cast<int>(std::ceil(to)) - 1);
    };
    const int first_i = static_cast<int>(std::floor(part.x0)), last_i = last_cell(part.x1, first_i);
    const int first_j = static_cast<int>(std::floor(part.y0)), last_j = last_cell(part.y1, first_j);
    for (int j = first_j; j <= last_j; ++j) {
        const std::array<Four, 4> down = weights_in(j, part.y0, part.y1);
        for (int i = first_i; i <= last_i; ++i) {
            const std::array<Four, 4> across = weights_in(i, part.x0, part.x1);
            const float* const first = samples.data() + std::ptrdiff_t{j - 1} * columns + (i - 1);
            std::array<Four, 4> rows{}; // of samples, as Bezier points across
            for (std::size_t row = 0; row < 4; ++row)
                for (std::size_t n = 0; n < 4; ++n)
                    for (std::size_t k = 0; k < 4; ++k)
                        rows[row][n] +=
                            across[n][k] *
                            static_cast<double>(first[row * static_cast<std::size_t>(columns) + k]);
            for (std::size_t m = 0; m < 4; ++m)
                for (std::size_t n = 0; n < 4; ++n) {
                    const double point = down[m][0] * rows[0][n] + down[m][1] * rows[1][n] +
                                         down[m][2] * rows[2][n] + down[m][3] * rows[3][n];
                    bounds = {std::min(bounds.least, point), std::max(bounds.largest, point)};
                }
        }
    }
    return bounds;
}

} // namespace obscura::terrain
