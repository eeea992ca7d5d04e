// SPDX-License-Identifier: Apache-2.0
// Surface about a pole of a simple cylindrical raster: cubics on a square grid about the pole.
#pragma once

#include "terrain/sample_pyramid.hpp"

#include <array>
#include <cstddef>
#include <functional>

namespace obscura::terrain {

/// The rows nearest to a pole in coordinates that have no singularity there: X and Y are the distance from
/// the pole, in rows, times cosine and sine of the longitude. The surface is single-valued and its slope
/// continuous at the pole and around it. A value; thread-safe.
class PolarCap {
public:
    /// Within a third of `rows` of the pole the cap is the surface; up to `rows`, at most this many, it goes
    /// over to the cubics along rows and columns.
    static constexpr double max_reach = 3;
    /// Rows of the raster from the pole on that a cap is made of, at most.
    static constexpr int max_rows = 8;

    PolarCap() = default;
    /// `value`: of the raster at a distance from the pole, in rows, and a part of a full turn; of the pole
    /// itself the mean of all turns.
    PolarCap(double rows, const std::function<double(double distance, double turn)>& value);

    /// Whether all nodes have data.
    [[nodiscard]] bool exists() const { return exists_; }
    /// Bounds of all values.
    [[nodiscard]] SampleRange range() const { return range_; }
    [[nodiscard]] double at(double distance, double turn) const;
    /// Share of the cap in the surface, 0 to 1; 0 from `rows` on.
    [[nodiscard]] double share(double distance) const;

private:
    static constexpr int reach = 4; ///< nodes from the pole along an axis
    static constexpr std::size_t edge = 2 * reach + 1;

    std::array<double, edge * edge> nodes_{};
    SampleRange range_;
    double rows_ = max_reach;
    bool exists_ = false;
};

} // namespace obscura::terrain
