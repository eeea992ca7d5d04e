// SPDX-License-Identifier: Apache-2.0
// Raster on a body, sampled at positions over footprints: cubic, across its seam and the poles.
#pragma once

#include "terrain/maps/map_frame.hpp"
#include "terrain/sample_pyramid.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

namespace obscura::terrain {

/// Samples and where they are. Immutable; thread-safe.
///
/// Between samples Catmull-Rom cubics run along columns and rows (Keys, Cubic convolution interpolation for
/// digital image processing, IEEE ASSP 29, 1981): the surface goes through the samples and its slope is
/// continuous. A footprint larger than a pixel selects two reduced levels, which are blended; where pixels
/// are much smaller along one axis than along the other, as beside the poles of a simple cylindrical map, the
/// cubic is stretched along it. At a pole the surface is the mean of the row around it.
class Raster {
public:
    /// The samples' finest level has the frame's size. Throws std::invalid_argument, with a phrase for a
    /// message, if not, or if a full turn is no whole number of columns.
    Raster(std::shared_ptr<const SamplePyramid> samples, const MapFrame& frame);

    /// A direction in a raster: its place, and samples per radian of arc (planar: per metre) there.
    struct Located {
        SamplePlace place, density;
        /// Radians of arc (planar: metres) of a pixel along its longer side.
        [[nodiscard]] double pixel() const { return 1 / std::min(density.x, density.y); }
    };
    [[nodiscard]] Located locate(Vec3 p) const { return {frame_.place(p), frame_.samples_per_radian(p)}; }

    /// Samples a raster at many positions that are near each other, and keeps what it read for the next ones,
    /// up to some MB. Thread-bound; the raster must outlive it.
    class Reader {
    public:
        explicit Reader(const Raster& raster) : raster_(raster) {}

        /// The sample at the direction of `p` (planar: at its x and y). `footprint`: what is shorter than
        /// about twice that is left out, in radians of arc (planar: m); 0: nothing. NaN where the nearest
        /// sample has no data and beyond the raster's edges. Throws InputError if the samples cannot be read.
        [[nodiscard]] double at(Vec3 p, double footprint) { return sample(raster_.locate(p), footprint); }
        [[nodiscard]] double sample(const Located& located, double footprint);
        /// The same at each place of a block, over `footprints`, bit for bit: `sample` for each.
        void sample(const MapBlock& block, std::span<const double> footprints, std::span<double> out);
        /// The finest level, linear between four samples; NaN if one of them has no data.
        [[nodiscard]] double bilinear(Vec3 p);

    private:
        struct Block {
            std::vector<float> samples;
        };

        [[nodiscard]] double level_value(int level, SamplePlace place, double stretch_x, double stretch_y);
        [[nodiscard]] double narrow(int level, double x, double y);
        /// Whether the value at a place is that of the finest level's plain cubic.
        [[nodiscard]] bool plain(SamplePlace place, SamplePlace density, double footprint) const;
        [[nodiscard]] double wide(int level, double x, double y, double stretch_x, double stretch_y);
        /// First sample of the four by four from (column, row) and the distance of rows.
        [[nodiscard]] const float* stencil(int level, std::int64_t column, std::int64_t row);
        void fill(int level, std::int64_t block_x, std::int64_t block_y, Block& block);
        void read_row(int level, std::int64_t column, std::int64_t row, int count, float* out);

        const Raster& raster_;
        std::unordered_map<std::uint64_t, Block> blocks_;
        std::uint64_t last_key_ = ~std::uint64_t{0};
        const Block* last_ = nullptr;
        std::vector<double> across_; ///< weights of columns
    };

    [[nodiscard]] const SamplePyramid& samples() const { return *samples_; }
    [[nodiscard]] const MapFrame& frame() const { return frame_; }
    /// Whether it covers the whole sphere without holes.
    [[nodiscard]] bool whole() const;
    /// Whether the raster, holes apart, has samples around that place of its frame.
    [[nodiscard]] bool inside(SamplePlace at) const;
    /// Samples per radian of arc (planar: per metre) of the directions within the angle `radius` of that of
    /// `centre`: smallest and largest along columns and rows.
    struct Densities {
        SamplePlace least, largest;
    };
    [[nodiscard]] Densities densities(Vec3 centre, double radius) const;
    /// Part of a raster: places from `least` to `largest`; `all`: anywhere.
    struct Area {
        SamplePlace least, largest;
        bool all = false;
    };
    /// Contains the places of all directions within the angle `radius` of the direction of `centre` (planar:
    /// of all points within that distance).
    [[nodiscard]] Area area(Vec3 centre, double radius) const;
    /// Bounds of what Reader::at() returns in that area at any footprint up to `footprint`. Least is above
    /// largest if the area has no samples.
    [[nodiscard]] SampleRange range(const Area& area, Vec3 centre, double radius, double footprint) const;

private:
    /// Sizes of one level.
    struct Level {
        double scale = 1;                     ///< finest samples per sample
        std::int64_t width, height;           ///< width: distinct columns
        double last_x = 1, last_y = 1;        ///< shares of a sample that its last column and row cover
        double first_mean = 0, last_mean = 0; ///< of the rows beside the poles
    };

    [[nodiscard]] const Level& level(int k) const { return levels_[static_cast<std::size_t>(k)]; }
    [[nodiscard]] double row_mean(int level, std::int64_t row) const;
    [[nodiscard]] std::int64_t stored_row(int level, std::int64_t row, bool& beyond_pole) const;

    std::shared_ptr<const SamplePyramid> samples_;
    MapFrame frame_;
    std::int64_t period_ = 0; ///< columns of a full turn, 0: none
    bool first_pole_ = false, last_pole_ = false;
    std::vector<Level> levels_;
};

} // namespace obscura::terrain
