// SPDX-License-Identifier: Apache-2.0
// Blocks of samples of one level of a raster, and their reduction to the next coarser level.
#pragma once

#include "terrain/geometry/map_frame.hpp"

#include <cstdint>
#include <vector>

namespace obscura::terrain::obt {

/// Samples of columns x to x + columns - 1 and rows y to y + rows - 1 of a level, row-major; NaN: missing.
struct SampleBlock {
    int level = 0;
    std::int64_t x = 0, y = 0;
    int columns = 0, rows = 0;
    std::vector<float> samples;

    [[nodiscard]] float at(std::int64_t column, std::int64_t row) const {
        return samples[static_cast<std::size_t>(row - y) * static_cast<std::size_t>(columns) +
                       static_cast<std::size_t>(column - x)];
    }
};

/// The next coarser level below `fine`, whose first column and row are even and whose last ones are odd or
/// the last of the raster. Means over the valid samples: of pixels by their area (at the edges of a raster of
/// `width` x `height` finest samples they stand for fewer), of nodes with weights 1/4, 1/2, 1/4 each way.
/// Double precision inside.
void reduce(const SampleBlock& fine, Registration registration, std::int64_t width, std::int64_t height,
            SampleBlock& coarse);

/// Largest difference between samples of `fine`, columns x0 to x1 - 1 and rows y0 to y1 - 1, and `coarse`
/// interpolated linearly.
[[nodiscard]] double largest_difference(const SampleBlock& fine, const SampleBlock& coarse,
                                        Registration registration, std::int64_t x0, std::int64_t y0,
                                        std::int64_t x1, std::int64_t y1);

} // namespace obscura::terrain::obt
