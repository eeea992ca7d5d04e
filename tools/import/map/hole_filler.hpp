// SPDX-License-Identifier: Apache-2.0
// Filling of holes in rasters of any size by normalised convolution on a Gaussian pyramid.
#pragma once

#include "core/io/file_descriptor.hpp"
#include "tools/import/map/raster_reader.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>
#include <vector>

namespace obscura::tools {

/// Raster whose missing numbers are replaced. Down the pyramid, the mean of the numbers present in 5 x 5
/// samples (weights 1 4 6 4 1) becomes a number of the next level, and its weight the sum of theirs (Knutsson
/// and Westin 1993, normalised convolution); up again, each level is weight * number + (1 - weight) * the
/// level above, interpolated. Numbers that are present stay as they are.
class HoleFiller final : public RasterReader {
public:
    /// Reads all of `inner` once and keeps 2.7 bytes a number in a file without a name in `folder`. `wraps`:
    /// the last column is beside the first. `round`: numbers are integers. `progress`: rows done; may throw.
    /// Throws InputError if a plane has no number at all, OutputError if `folder` is full.
    HoleFiller(RasterReader& inner, bool wraps, bool round, const std::filesystem::path& folder,
               const std::function<void(std::uint64_t)>& progress);

    /// Missing numbers of all planes, and the rows and columns of the rectangle that has them.
    struct Holes {
        std::uint64_t samples = 0;
        std::int64_t left = 0, right = 0, top = 0, bottom = 0;
    };
    [[nodiscard]] const Holes& holes() const { return holes_; }

    [[nodiscard]] std::uint32_t planes() const override { return inner_.planes(); }
    [[nodiscard]] std::int64_t width() const override { return inner_.width(); }
    [[nodiscard]] std::int64_t height() const override { return inner_.height(); }
    [[nodiscard]] bool by_rows() const override { return true; }
    void read(std::uint32_t plane, std::int64_t x, std::int64_t y, int columns, int rows,
              std::span<float> out) override;

    /// One number of a level and its weight.
    struct Weighted {
        float number = 0, weight = 0;
    };

private:
    struct Level {
        std::int64_t width = 0, height = 0;
        std::uint64_t place = 0; ///< of plane 0, bytes in the scratch file
    };
    struct CachedRow {
        std::int64_t y = -1;
        std::vector<float> numbers;
    };
    class Reducer;

    void keep(std::uint32_t plane, std::size_t level, std::int64_t y, const std::vector<Weighted>& row);
    [[nodiscard]] std::vector<Weighted> kept(std::uint32_t plane, std::size_t level, std::int64_t y) const;
    /// Row y of a level of the plane, without holes; valid until the level is asked for another six.
    const std::vector<float>& filled(std::uint32_t plane, std::size_t level, std::int64_t y);
    /// Row y of level `level` by interpolation of the level above.
    std::vector<float> expanded(std::uint32_t plane, std::size_t level, std::int64_t y);

    RasterReader& inner_;
    bool wraps_, round_;
    Holes holes_;
    std::vector<Level> levels_; ///< level 0 is the raster
    std::uint64_t plane_bytes_ = 0;
    FileDescriptor scratch_;
    std::vector<std::vector<CachedRow>> cache_; ///< by level
    std::uint32_t cached_plane_ = 0;
};

} // namespace obscura::tools
