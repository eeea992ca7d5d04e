// SPDX-License-Identifier: Apache-2.0
// Light time along rays: the frame of a body that moves while light travels from it.
//
// Light that is at a point at the time t was at the distance s along its ray at t - s / c. In a frame that
// moves with the body, at beta = v / c, the ray n from there is straight too: the line s (n + beta). So every
// point of a body is where it was when its light left it, to first order in v / c; the body's velocity and
// attitude are those at the light time of its centre.
#pragma once

#include "core/geometry.hpp"

#include <cmath>

namespace obscura::renderer {

/// Vector w = s (n + beta) of the moving frame as the inertial s n, n being a unit vector: its length is the
/// distance s.
[[nodiscard]] inline Vec3 untilted(Vec3 w, Vec3 beta) {
    const double along = dot(w, beta), rest = 1 - dot(beta, beta);
    return w - (std::sqrt(along * along + rest * dot(w, w)) - along) / rest * beta;
}

/// A body as a camera sees it at one instant, in the inertial frame. Without light time it is at rest.
struct ApparentBody {
    /// Its centre where a straight line of sight meets it, its attitude when that light left it.
    Pose pose;
    Vec3 beta{0, 0, 0}; ///< velocity over the speed of light then
    double range_m = 0; ///< distance of the centre

    [[nodiscard]] bool moves() const { return length_squared(beta) > 0; }
    /// Its centre when light at the distance `path_m` before the camera, along any path, was there.
    [[nodiscard]] Vec3 position_at(double path_m) const {
        return moves() ? pose.position_m + (range_m - path_m) * beta : pose.position_m;
    }
    /// Rays from `camera_m` in its frame: their origin, and the direction of the unit vector `n`, of unit
    /// length.
    [[nodiscard]] Vec3 eye_m(Vec3 camera_m) const {
        return rotate(conjugate(pose.orientation), camera_m - position_at(0));
    }
    [[nodiscard]] Vec3 direction(Vec3 n) const {
        return rotate(conjugate(pose.orientation), moves() ? normalized(n + beta) : n);
    }
    /// Length in its frame of a unit of distance along `n`.
    [[nodiscard]] double stretch(Vec3 n) const { return moves() ? length(n + beta) : 1; }
    /// Inertial vector from `camera_m` to its point `point_m` (body frame), of the length of the light's
    /// path.
    [[nodiscard]] Vec3 towards(Vec3 camera_m, Vec3 point_m) const {
        const Vec3 w = position_at(0) + rotate(pose.orientation, point_m) - camera_m;
        return moves() ? untilted(w, beta) : w;
    }
    /// From the body to the Sun as it sees it, inertial axes: with the aberration of its motion. `sun_m`: the
    /// Sun's centre, inertial.
    [[nodiscard]] Vec3 to_sun_m(Vec3 sun_m) const {
        const Vec3 to_sun = sun_m - pose.position_m;
        return moves() ? to_sun + length(to_sun) * beta : to_sun;
    }
};

} // namespace obscura::renderer
