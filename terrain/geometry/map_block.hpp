// SPDX-License-Identifier: Apache-2.0
// Positions of a body and their places in a raster, some dozens at once in vector registers.
#pragma once

#include "core/geometry.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

namespace obscura::terrain {

inline constexpr std::size_t map_block_size = 64;

/// Structure of arrays; lanes beyond those in use hold copies of the last one.
struct alignas(64) MapBlock {
    using Values = std::array<double, map_block_size>;
    Values x, y, z;              ///< position
    Values distance;             ///< from the origin
    Values place_x, place_y;     ///< SamplePlace
    Values density_x, density_y; ///< samples per radian of arc (planar: per metre)
    std::size_t count = 0;

    /// At most map_block_size positions, at least one.
    void load(std::span<const Vec3> positions);
};

/// Constants of a map's formulas. What a position becomes depends on nothing but these: IEEE operations only,
/// no fused ones, and none of the C library's functions, which differ between machines.
struct MapFormula {
    enum class Kind : std::uint8_t {
        cylindrical, ///< simple cylindrical, of a sphere or of a spheroid
        polar,       ///< polar stereographic of a sphere
        planar,
        none, ///< position by position: MapFrame::place()
    };
    Kind kind = Kind::none;
    double sine_sign = 1;  ///< polar: of z towards the map's pole
    double latitude_z = 1; ///< cylindrical: factor of z before the latitude
    /// Metres of the map along x and y. Cylindrical: per radian. Polar: half of those per radian at the pole.
    double scale_x = 1, scale_y = 1;
    double middle_x = 0, turn = 1; ///< cylindrical: x_m of the raster's middle and of a full turn
    double centre_x = 0;           ///< cylindrical: x_m of longitude 0 is minus this
    double cosine = 1, sine = 0;   ///< polar: of the meridian of the y axis
    /// Place from x_m and y_m: place.x = xx x_m + xy y_m + x0.
    double xx = 1, xy = 0, x0 = 0, yx = 0, yy = 1, y0 = 0;
    double density_x = 1, density_y = 1; ///< samples per metre of the map
};

/// Fills places, densities and distances of the block; with Kind::none, distances alone.
void locate(const MapFormula& formula, MapBlock& block);

/// Four by four samples each, in rows of `row` floats.
struct alignas(64) StencilBlock {
    std::array<std::int64_t, map_block_size> first; ///< addresses of the first samples
    std::array<double, map_block_size> t, u;        ///< places between the middle ones, 0 to 1
};
/// Catmull-Rom cubics along rows, then along the column of their values.
void sample_stencils(const StencilBlock& stencils, std::size_t count, std::size_t row,
                     std::span<double, map_block_size> values);

} // namespace obscura::terrain
