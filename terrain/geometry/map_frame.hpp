// SPDX-License-Identifier: Apache-2.0
// Place of a raster's samples on a body: projection, transform of pixels to the map, registration, extent.
#pragma once

#include "terrain/geometry/map_block.hpp"
#include "terrain/geometry/projection.hpp"

#include <array>
#include <cstdint>
#include <string>

namespace obscura::terrain {

/// What a sample belongs to.
enum class Registration : std::uint8_t {
    pixel, ///< the middle of its pixel
    node,  ///< a node of the grid: the first sample lies at the origin of the transform
};
constexpr auto enum_names(Registration /*type*/) {
    return std::array{EnumName{Registration::pixel, "pixel"}, EnumName{Registration::node, "node"}};
}

/// What the numbers of a height raster are.
enum class HeightMeaning : std::uint8_t {
    height, ///< above the reference surface, along the direction from the centre (planar: along z)
    normal, ///< above the reference surface, along its normal
    radius, ///< distance from the centre
};
constexpr auto enum_names(HeightMeaning /*type*/) {
    return std::array{EnumName{HeightMeaning::height, "height"}, EnumName{HeightMeaning::normal, "normal"},
                      EnumName{HeightMeaning::radius, "radius"}};
}

/// Place in a raster, in samples: sample (i, j) is at x = i, y = j, whatever the registration.
struct SamplePlace {
    double x = 0, y = 0;
};

/// Transform of GDAL: x_m = t[0] + t[1] * column + t[2] * row, y_m = t[3] + t[4] * column + t[5] * row, with
/// (0, 0) at the outer corner of the first pixel (pixel registration) or at the first sample (node).
using PixelTransform = std::array<double, 6>;

/// Where the samples of a raster of that size are. A value; thread-safe.
class MapFrame {
public:
    MapFrame() = default;
    /// Throws std::invalid_argument, with a phrase for a message, if the transform cannot be inverted, a
    /// value is not finite, or a simple cylindrical map is turned or exceeds the poles by more than a pixel.
    MapFrame(const Projection& projection, const PixelTransform& transform, Registration registration,
             std::int64_t width, std::int64_t height);

    /// Simple cylindrical map between longitudes (west of east: columns grow eastwards; else westwards) and
    /// latitudes: of the outer edges of its pixels, or with `node` of its outer samples.
    [[nodiscard]] static MapFrame by_edges(Projection projection, Registration registration,
                                           std::int64_t width, std::int64_t height, double left_rad,
                                           double right_rad, double top_rad, double bottom_rad);

    [[nodiscard]] const Projection& projection() const { return projection_; }
    [[nodiscard]] const PixelTransform& transform() const { return transform_; }
    [[nodiscard]] Registration registration() const { return registration_; }
    [[nodiscard]] std::int64_t width() const { return width_; }
    [[nodiscard]] std::int64_t height() const { return height_; }

    /// The place of the direction of `p` (planar: of its x and y), which need not be in the raster. In a
    /// simple cylindrical map x is within half a turn of the raster's middle.
    [[nodiscard]] SamplePlace place(Vec3 p) const;
    /// The direction of that place (planar: the point of the plane z = 0).
    [[nodiscard]] Vec3 position(SamplePlace place) const;
    /// Columns and rows per radian of arc of the direction of `p` along x and y of the raster (planar: per
    /// metre).
    [[nodiscard]] SamplePlace samples_per_radian(Vec3 p) const;
    /// Fills the block's places and densities as place() and samples_per_radian() have them, up to rounding;
    /// those of a position do not depend on what else is in the block.
    void locate(MapBlock& block) const;

    /// Change of the place by a small step, m, from a point `p` of the body: columns and rows.
    [[nodiscard]] SamplePlace step(Vec3 p, Vec3 step_m) const;

    /// Columns of a full turn of longitude if the raster covers it (its first column follows on its last or
    /// is the same again); 0: it does not.
    [[nodiscard]] double period() const { return period_; }
    /// y of the poles if rows reach to them, within a thousandth of a pixel; NaN: they do not.
    [[nodiscard]] double first_pole_y() const { return first_pole_y_; }
    [[nodiscard]] double last_pole_y() const { return last_pole_y_; }

private:
    void make_formula();

    Projection projection_{};
    PixelTransform transform_{0, 1, 0, 0, 0, -1};
    Registration registration_ = Registration::pixel;
    std::int64_t width_ = 1, height_ = 1;
    double determinant_ = -1;
    double period_ = 0, middle_x_m_ = 0;
    double first_pole_y_ = 0, last_pole_y_ = 0;
    MapFormula formula_;
};

} // namespace obscura::terrain
