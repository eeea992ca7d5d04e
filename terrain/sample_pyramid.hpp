// SPDX-License-Identifier: Apache-2.0
// Raster of any size with reduced levels, read block by block.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

namespace obscura::terrain {

/// Smallest and largest sample.
struct SampleRange {
    float least = 0, largest = 0;
    /// Bound of the differences of samples that are neighbours in a row or a column.
    float largest_step = std::numeric_limits<float>::infinity();
};

/// One plane of samples and its reduced levels: level 0 is the finest, each further one has half the width
/// and height, rounded up. Whole in memory, or in a file that is read as needed. Thread-safe.
class SamplePyramid {
public:
    virtual ~SamplePyramid() = default;

    [[nodiscard]] virtual int levels() const = 0;
    [[nodiscard]] virtual std::int64_t width(int level) const = 0;
    [[nodiscard]] virtual std::int64_t height(int level) const = 0;
    /// Where samples of level k lie: at every 2^k-th finest sample (of grids of nodes), or in the middle of
    /// 2^k by 2^k of them, of which they are the mean.
    [[nodiscard]] virtual bool levels_of_nodes() const { return false; }
    /// Smallest and largest sample of the finest level (of the whole raster), in the unit of the samples.
    [[nodiscard]] virtual float least() const = 0;
    [[nodiscard]] virtual float largest() const = 0;
    /// Whether samples of the finest level are without data.
    [[nodiscard]] virtual bool has_holes() const = 0;
    /// Bounds of the finest level's samples in a block of it, which may exceed the raster; no smaller than
    /// what is there, possibly larger.
    [[nodiscard]] virtual SampleRange range(std::int64_t /*x*/, std::int64_t /*y*/, std::int64_t /*columns*/,
                                            std::int64_t /*rows*/) const {
        return {least(), largest()};
    }

    /// Reads the samples of columns x to x + columns - 1 and rows y to y + rows - 1, all inside the level,
    /// into `out` (rows * columns, row-major). Samples without data are NaN. Throws InputError if the file
    /// cannot be read or is damaged.
    virtual void read(int level, std::int64_t x, std::int64_t y, int columns, int rows,
                      std::span<float> out) const = 0;
};

} // namespace obscura::terrain
