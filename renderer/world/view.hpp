// SPDX-License-Identifier: Apache-2.0
// Geometry of a scene as the camera sees it at one instant: field of view, bodies, stars.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <string>
#include <vector>

namespace obscura::scene {
struct Scene;
}

namespace obscura::renderer {

class Projection;
struct RowState;
struct FieldStars;
struct StarObserver;

/// A body seen by the camera.
struct SeenBody {
    std::string name;
    double extent_m = 0;   ///< diameter of the bounding sphere about its origin
    double distance_m = 0; ///< from the camera to its origin
    /// From the camera to the surface, towards the origin; distance_m where that line meets no surface.
    double surface_m = 0;
    double extent_px = 0;              ///< of the bounding sphere; infinite: the camera is inside it
    double boresight_rad = 0;          ///< angle of its origin to the boresight
    std::optional<double> phase_rad{}; ///< angle Sun, body, camera; none without Sun
    /// Height of the camera above the ground below it, towards the body's origin (of a plane, along z); none:
    /// there is no ground, or the camera is inside.
    std::optional<double> altitude_m{};
    /// Elevation of the Sun's centre there, above the horizon of a sphere (plane); none without Sun or
    /// ground.
    std::optional<double> sun_elevation_rad{};
    double sun_distance_m = 0;           ///< from its origin to the Sun's centre
    bool in_field = false;               ///< its bounding sphere reaches into the field
    bool around_camera = false;          ///< the camera is inside its closed surface
    std::vector<std::string> notes{};    ///< of its shape and maps, see Shape::notes()
    std::vector<std::string> warnings{}; ///< see Shape::warnings()
};

/// Field of view and what is in it.
struct View {
    double field_x_rad = 0, field_y_rad = 0; ///< across the middle row and the middle column
    double pixel_rad = 0;                    ///< angle of a pixel in the middle of the field
    std::vector<SeenBody> bodies;            ///< in the order of the scene, without the Sun
    bool sun_in_field = false;
    double sun_distance_m = 0;          ///< from the camera to its centre
    std::size_t stars = 0;              ///< stars in the field, those behind bodies too
    std::optional<double> faintest_v{}; ///< Johnson V of the faintest of them
};

/// The view of `row` through `lens`. `stars`: those that may be in the field.
[[nodiscard]] View view_of(const scene::Scene& scene, const RowState& row, const Projection& lens,
                           const FieldStars& stars, const StarObserver& observer);

} // namespace obscura::renderer
