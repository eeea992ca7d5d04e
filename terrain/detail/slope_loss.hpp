// SPDX-License-Identifier: Apache-2.0
// Mean squared slope of a random surface that the cells of a terrain are too coarse for.
#pragma once

#include <functional>
#include <vector>

namespace obscura::terrain {

/// Mean squared slope along one direction of the shading normals of a random surface on square cells:
/// differences over two cells at the vertices, linear between these. `structure(distance)`: mean square
/// difference of heights at a distance, the same in all directions.
[[nodiscard]] double kept_squared_slope(const std::function<double(double)>& structure, double cell);

/// Share of the mean squared slope of features of one size that cells lose, by the width of the cells over
/// that size. As cells of all levels are powers of two apart, it is a table.
class SlopeLoss {
public:
    /// `structure`: of the features, distances over their size. `cell`: width of the cells of any level, in
    /// any unit.
    SlopeLoss(const std::function<double(double)>& structure, double cell);

    /// Mean squared slope along one direction, of heights over the features' size.
    [[nodiscard]] double whole() const { return whole_; }
    /// `ratio`: width of the cells over the features' size, the `cell` of a level over a power of two.
    [[nodiscard]] double share(double ratio) const;

private:
    double whole_ = 0;
    std::vector<double> lost_; ///< at ratios from 1/2 to 1, 1/4 to 1/2 ...
};

} // namespace obscura::terrain
