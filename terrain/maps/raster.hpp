// SPDX-License-Identifier: Apache-2.0
// Raster on a body, sampled at positions over footprints: cubic, across its seam and the poles.
#pragma once

#include "terrain/geometry/map_frame.hpp"
#include "terrain/maps/polar_cap.hpp"
#include "terrain/maps/thinned_rows.hpp"
#include "terrain/sample_pyramid.hpp"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <unordered_map>
#include <vector>

namespace obscura::terrain {

/// Samples and where they are. Immutable; thread-safe.
///
/// Between samples Catmull-Rom cubics run along columns and rows: the surface goes through the samples and
/// its slope is continuous. A footprint larger than a pixel selects two reduced levels, which are blended;
/// where pixels are smaller along one axis than along the other, the cubic is stretched along it.
///
/// Towards the poles of a simple cylindrical map, columns come closer to each other than rows are: from where
/// they are a third as far apart, means of 2, 4, 8 ... columns take their place (ThinnedRows), two of these
/// blended, so that nothing is finer along parallels than along meridians, which would be ridges that run to
/// the pole. About the pole of a whole turn there is a grid of its own (PolarCap), and its slope is
/// continuous too.
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
        friend class Raster;
        struct Block {
            std::vector<float> samples;
        };

        /// A level, or the columns that are made of it.
        struct Columns {
            int level = 0, halvings = 0;
            std::int64_t count = 0;
        };
        [[nodiscard]] Columns columns(int level, int halvings) const;

        [[nodiscard]] double level_value(int level, SamplePlace place, double stretch_x, double stretch_y);
        [[nodiscard]] double narrow(const Columns& columns, double x, double y);
        /// Whether the value at a place is that of plain cubics of the finest level's rows.
        [[nodiscard]] bool plain(SamplePlace place, double rows) const;
        [[nodiscard]] double wide(const Columns& columns, double x, double y, double stretch_x,
                                  double stretch_y);
        /// First sample of the four by four from (column, row) on.
        [[nodiscard]] const float* stencil(const Columns& columns, std::int64_t column, std::int64_t row);
        void forget();
        void fill(const Columns& columns, std::int64_t block_x, std::int64_t block_y, Block& block);
        void read_row(const Columns& columns, std::int64_t column, std::int64_t row, int count, float* out);
        void read_stored(const Columns& columns, std::int64_t first, std::int64_t row, int count, float* out);

        const Raster& raster_;
        std::unordered_map<std::uint64_t, Block> blocks_;
        struct Last {
            std::uint64_t key = ~std::uint64_t{0};
            const float* samples = nullptr;
        };
        std::array<Last, 2> last_;
        std::vector<double> across_; ///< weights of columns
        std::vector<float> line_;    ///< samples that are thinned
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
        double scale = 1;              ///< finest samples per sample
        std::int64_t width, height;    ///< width: distinct columns
        double last_x = 1, last_y = 1; ///< shares of a sample that its last column and row cover
        ThinnedRows thinned;           ///< simple cylindrical: towards the poles
        PolarCap first_cap, last_cap;
    };
    /// How many columns are one, as a real number: that many halvings, and the share of the next one.
    struct Halvings {
        int whole = 0;
        double share = 0;
    };
    [[nodiscard]] static Halvings halvings(double columns, int most);

    [[nodiscard]] const Level& level(int k) const { return levels_[static_cast<std::size_t>(k)]; }
    [[nodiscard]] PolarCap polar_cap(int level, bool first) const;
    [[nodiscard]] std::int64_t stored_row(int level, std::int64_t row, bool& beyond_pole) const;
    /// Bounds of the finest level's plain cubics in an area from its samples; false: it is large or beyond
    /// the raster, or samples are missing.
    [[nodiscard]] bool cubic_range(const Area& area, SampleRange& range) const;
    /// Place in a level's rows of that of the finest one.
    [[nodiscard]] double level_row(int level, double y) const;
    [[nodiscard]] double level_column(int level, double x) const;
    /// Place in a level's rows of `count` columns, and in parts of a full turn, of that of the finest one.
    [[nodiscard]] double thinned_column(int level, double x, std::int64_t count) const;
    [[nodiscard]] double level_turn(int level, double x) const;
    /// Columns that are taken together for a footprint, and where they are close to each other.
    [[nodiscard]] double columns_of(SamplePlace density, double footprint) const;

    std::shared_ptr<const SamplePyramid> samples_;
    MapFrame frame_;
    std::int64_t period_ = 0; ///< columns of a full turn, 0: none
    bool cylindrical_ = false, first_pole_ = false, last_pole_ = false;
    std::vector<Level> levels_;
};

} // namespace obscura::terrain
