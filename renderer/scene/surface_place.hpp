// SPDX-License-Identifier: Apache-2.0
// Places on bodies by longitude, latitude and height, and paths over them.
#pragma once

#include "core/geometry.hpp"
#include "core/text/enum_names.hpp"
#include "renderer/scene/scene.hpp"

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace obscura::scene {

/// Meaning of latitudes, and the line along which heights count. Longitudes count about the body's z axis,
/// from its x axis towards its y axis.
enum class Latitudes : std::uint8_t {
    /// Direction from the body's origin, as SPICE's latrec_c and IAU's default for bodies of one radius;
    /// heights count along that direction.
    planetocentric,
    /// Direction of the outer normal of the reference ellipsoid, as SPICE's georec_c, GDAL and PROJ
    /// (geodetic); heights count along the normal.
    planetographic,
};
constexpr auto enum_names(Latitudes /*type*/) {
    return std::array{EnumName{Latitudes::planetocentric, "planetocentric"},
                      EnumName{Latitudes::planetographic, "planetographic"}};
}

/// Surface from which heights count.
enum class HeightAbove : std::uint8_t {
    reference, ///< the ellipsoid of the body's radii
    ground,    ///< the body's outermost surface there, with its maps and detail
};
constexpr auto enum_names(HeightAbove /*type*/) {
    return std::array{EnumName{HeightAbove::reference, "reference"}, EnumName{HeightAbove::ground, "ground"}};
}

/// Axes of attitudes at a place.
enum class PlaceAxes : std::uint8_t {
    parent,        ///< those of the parent body
    east_north_up, ///< x east, y north, z along the line of the height, at every instant
};
constexpr auto enum_names(PlaceAxes /*type*/) {
    return std::array{EnumName{PlaceAxes::parent, "parent"},
                      EnumName{PlaceAxes::east_north_up, "east-north-up"}};
}

/// Longitude, latitude (rad) and height (m) at an instant.
struct SurfacePlace {
    double time_s = 0; ///< scene time
    double longitude_rad = 0, latitude_rad = 0, height_m = 0;
};

/// Places of a motion as a scene file gives them.
struct SurfaceTrack {
    std::vector<SurfacePlace> places; ///< at least one, strictly increasing in time
    Latitudes latitudes = Latitudes::planetocentric;
    HeightAbove above = HeightAbove::reference;
    PlaceAxes axes = PlaceAxes::parent;
    std::string position{}; ///< "file:line:column: key" for messages
};

/// Unit vector of a direction.
[[nodiscard]] Vec3 direction_of(double longitude_rad, double latitude_rad);

/// Line on which the heights of a place count: points `foot_m` + s `up`, s being 0 on the reference ellipsoid
/// of those semi-axes. Without an ellipsoid (radii of 0) the foot is the origin.
struct HeightLine {
    Vec3 foot_m, up; ///< body frame; `up` has unit length
};
[[nodiscard]] HeightLine height_line(Vec3 up, Latitudes latitudes, Vec3 radii_m);

/// Rotation from the local axes (x east, y north, z up) to the body's.
[[nodiscard]] Quat east_north_up(double longitude_rad, Vec3 up);

/// Path over a body: between places along the great circle of their directions `up`, heights linear; before
/// the first and after the last it holds. Heights of `track` count from the ellipsoid of those semi-axes, or
/// from the origin where they are 0, whatever SurfaceTrack::above says. Attitudes are those of `attitudes`,
/// in the axes of the track.
[[nodiscard]] std::shared_ptr<const PosePath> surface_path(SurfaceTrack track, Vec3 radii_m,
                                                           std::shared_ptr<const PosePath> attitudes);

} // namespace obscura::scene
