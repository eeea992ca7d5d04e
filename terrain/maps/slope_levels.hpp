// SPDX-License-Identifier: Apache-2.0
// Mean squared slopes that the reduced levels of a height raster lose, per block of samples.
#pragma once

#include "terrain/geometry/map_frame.hpp"
#include "terrain/sample_pyramid.hpp"

#include <cstdint>
#include <vector>

namespace obscura::terrain {

/// Slope loss of each level, in blocks of 16 x 16 of its samples: the mean squared slope of the finest level
/// there less that of shading normals on cells of the level's samples (differences over two cells, linear
/// between). Slopes are samples per radian of arc (planar: per metre). Where columns are closer to each other
/// than rows, towards the poles of simple cylindrical maps, along columns over as long a way as along rows.
/// Immutable; thread-safe.
class SlopeLevels {
public:
    /// Rasters of more samples are not looked through.
    static constexpr std::int64_t max_samples = std::int64_t{1} << 26;

    /// Reads all levels. Throws InputError if the samples cannot be read.
    SlopeLevels(const SamplePyramid& samples, const MapFrame& frame);

    /// What cells of `rows` finest rows lose at a place.
    [[nodiscard]] double lost(SamplePlace place, double rows) const;

private:
    static constexpr std::int64_t edge = 16;
    /// Sums over the samples of a block.
    struct Sum {
        double value = 0, count = 0;
    };
    struct Level {
        double scale = 1; ///< finest samples per sample
        std::int64_t columns = 0, rows = 0;
        std::vector<Sum> whole, kept; ///< empty once `lost` is made
        std::vector<float> lost;
    };

    void add_slopes(const SamplePyramid& samples, const MapFrame& frame, int k, Level& level) const;
    [[nodiscard]] double at(const Level& level, SamplePlace place) const;

    double shift_; ///< of samples in their area
    bool turns_;
    std::vector<Level> levels_;
};

} // namespace obscura::terrain
