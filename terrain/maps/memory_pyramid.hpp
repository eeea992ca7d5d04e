// SPDX-License-Identifier: Apache-2.0
// Raster in memory with its reduced levels.
#pragma once

#include "terrain/sample_pyramid.hpp"

#include <cstddef>
#include <vector>

namespace obscura::terrain {

/// Largest raster that is kept in memory, in samples.
inline constexpr std::int64_t max_memory_samples = std::int64_t{1} << 26;

/// All levels down to one sample. A sample of a level is the mean over its area of what has data; it has none
/// if nothing there has. Immutable; thread-safe.
class MemoryPyramid final : public SamplePyramid {
public:
    /// `samples`: width * height, row-major; NaN where there is no data.
    MemoryPyramid(std::int64_t width, std::int64_t height, std::vector<float> samples);

    /// Bytes that a pyramid of that size takes.
    [[nodiscard]] static std::uint64_t bytes(std::int64_t width, std::int64_t height);

    [[nodiscard]] int levels() const override { return static_cast<int>(levels_.size()); }
    [[nodiscard]] std::int64_t width(int level) const override { return at(level).width; }
    [[nodiscard]] std::int64_t height(int level) const override { return at(level).height; }
    [[nodiscard]] float least() const override { return least_; }
    [[nodiscard]] float largest() const override { return largest_; }
    [[nodiscard]] bool has_holes() const override { return missing_ > 0; }
    [[nodiscard]] SampleRange range(std::int64_t x, std::int64_t y, std::int64_t columns,
                                    std::int64_t rows) const override;
    void read(int level, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) const override;

    /// Number of samples without data.
    [[nodiscard]] std::int64_t missing() const { return missing_; }

private:
    struct Level {
        std::int64_t width = 0, height = 0;
        std::vector<float> samples;
    };
    /// Smallest and largest sample of squares of some size.
    struct Bounds {
        std::int64_t width = 0, height = 0;
        std::vector<SampleRange> ranges;
    };

    [[nodiscard]] const Level& at(int level) const { return levels_[static_cast<std::size_t>(level)]; }
    void make_bounds();

    std::vector<Level> levels_;
    std::vector<Bounds> bounds_; ///< of squares of 8, 16, ... samples
    float least_ = 0, largest_ = 0;
    std::int64_t missing_ = 0;
};

} // namespace obscura::terrain
