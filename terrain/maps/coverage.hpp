// SPDX-License-Identifier: Apache-2.0
// Distance to the edge of a raster's samples: to its sides and to its holes.
#pragma once

#include "terrain/maps/raster.hpp"

#include <cstdint>
#include <memory>
#include <vector>

namespace obscura::terrain {

/// Distances are in radians of arc (planar: m) and end two samples before the edge, where cubics still have
/// all samples that they need. Immutable; thread-safe.
class Coverage {
public:
    /// Distances to holes are found on a grid of at most 4 million cells, each of which has data if all its
    /// samples have. Reads a raster with holes whole, or, if that is
    /// larger than what memory holds, the coarser level that is not. Throws InputError if it cannot be read.
    explicit Coverage(std::shared_ptr<const Raster> raster);

    /// The distance at the direction of `p`; 0 beyond the edge.
    [[nodiscard]] double distance(Vec3 p) const { return distance(raster_->locate(p)); }
    [[nodiscard]] double distance(const Raster::Located& located) const;
    /// A lower bound of all distances within the angle `radius` of the direction of `p` (planar: within that
    /// distance).
    [[nodiscard]] double min_distance(Vec3 p, double radius) const;
    [[nodiscard]] const Raster& raster() const { return *raster_; }

private:
    void find_holes();
    /// To the sides, along the columns and rows: x and y.
    [[nodiscard]] SamplePlace to_sides(SamplePlace at) const;
    /// In samples.
    [[nodiscard]] double to_holes(SamplePlace at) const;

    std::shared_ptr<const Raster> raster_;
    /// Per cell of the grid: distance of its middle to the nearest cell with a hole, in cells; empty: none.
    std::vector<float> cells_;
    std::int64_t columns_ = 0, rows_ = 0;
    double cell_ = 1; ///< samples along the edge of a cell
};

} // namespace obscura::terrain
