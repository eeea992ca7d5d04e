// SPDX-License-Identifier: Apache-2.0
// Map projections of rasters: simple cylindrical, polar stereographic and planar.
#pragma once

#include "core/geometry.hpp"
#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>

namespace obscura::terrain {

enum class ProjectionKind : std::uint8_t {
    simple_cylindrical,        ///< equirectangular: x by longitude, y by latitude
    north_polar_stereographic, ///< y of the meridian centre_longitude_rad points down from the pole
    south_polar_stereographic, ///< y of the meridian centre_longitude_rad points up from the pole
    planar,                    ///< x and y of the body frame
};
constexpr auto enum_names(ProjectionKind /*type*/) {
    using K = ProjectionKind;
    return std::array{EnumName{K::simple_cylindrical, "simple_cylindrical"},
                      EnumName{K::north_polar_stereographic, "north_polar_stereographic"},
                      EnumName{K::south_polar_stereographic, "south_polar_stereographic"},
                      EnumName{K::planar, "planar"}};
}

/// Latitudes that the projection is made with. Longitudes are the same in both.
enum class Latitudes : std::uint8_t {
    planetocentric, ///< of the direction from the centre
    planetographic, ///< of the spheroid's normal
};
constexpr auto enum_names(Latitudes /*type*/) {
    return std::array{EnumName{Latitudes::planetocentric, "planetocentric"},
                      EnumName{Latitudes::planetographic, "planetographic"}};
}

/// Point of a map, m: x to the right and y up, as PROJ has them.
struct MapPoint {
    double x_m = 0, y_m = 0;
};

/// Body frame to map and back; after Snyder, Map Projections: A Working Manual, USGS 1395 (1987), and with
/// the signs of PROJ's eqc and stere. Longitudes grow eastwards.
struct Projection {
    ProjectionKind kind = ProjectionKind::simple_cylindrical;
    Latitudes latitudes = Latitudes::planetocentric;
    /// Spheroid of the map, which need not be that of the body. With planetocentric latitudes, the formulas
    /// of the sphere of the equatorial radius apply.
    double equatorial_radius_m = 1, polar_radius_m = 1;
    double centre_longitude_rad = 0; ///< of x = 0 (simple cylindrical), of the y axis (stereographic)
    /// Latitude of true scale (of the kind of `latitudes`): of a stereographic map from 0 to its pole.
    double true_scale_latitude_rad = 0;

    /// A projection of the kind with true scale at the equator or at the pole.
    [[nodiscard]] static Projection of_sphere(ProjectionKind kind, double radius_m,
                                              double centre_longitude_rad = 0);

    /// The point of the direction of `p` (body frame, any length above 0; planar: of its x and y). Simple
    /// cylindrical: x within half a turn of 0. The pole opposite to a stereographic map's is at infinity.
    [[nodiscard]] MapPoint forward(Vec3 p) const;
    /// A unit direction of that map point (planar: the point of the plane z = 0).
    [[nodiscard]] Vec3 inverse(MapPoint at) const;
    /// Longitude, east positive, and latitude of the map's kind of the direction of `p`; not for planar.
    [[nodiscard]] double longitude_rad(Vec3 p) const;
    [[nodiscard]] double latitude_rad(Vec3 p) const;
    /// x of a full turn of longitude of a simple cylindrical map, m; of other maps 0.
    [[nodiscard]] double turn_m() const;
    /// Metres of the map along x and y per radian of arc of the direction of `p`, eastwards and northwards
    /// (of conformal maps the same in all directions; planar: 1, per metre). Infinite at the poles of a
    /// simple cylindrical map.
    [[nodiscard]] MapPoint metres_per_radian(Vec3 p) const;
    /// Distance of a parallel from the pole of a stereographic map, m.
    [[nodiscard]] double polar_distance_m(double latitude_rad) const;

    /// Change of the map's point by a small step, m, from a point `p` of the body: the derivative along it. A
    /// spheroid's polar map is taken for conformal in planetocentric latitudes, for which it is off by its
    /// flattening.
    [[nodiscard]] MapPoint step(Vec3 p, Vec3 step_m) const;

    constexpr bool operator==(const Projection&) const = default;

private:
    [[nodiscard]] bool spheroid() const {
        return latitudes == Latitudes::planetographic && equatorial_radius_m != polar_radius_m;
    }
    [[nodiscard]] double eccentricity() const;
};

} // namespace obscura::terrain
