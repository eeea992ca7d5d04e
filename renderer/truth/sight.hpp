// SPDX-License-Identifier: Apache-2.0
// Lines of sight for the truth table: what hides an object from the camera or from the Sun.
#pragma once

#include "renderer/truth/row_states.hpp"

#include <cstddef>

namespace obscura::renderer {

/// No body.
constexpr std::size_t no_body = static_cast<std::size_t>(-1);

/// Whether a body other than `but` lies in a direction (camera axes, any length) nearer than `range_m`.
[[nodiscard]] bool is_hidden(const TruthScene& scene, const TruthState& state, Vec3 direction, double range_m,
                             std::size_t but = no_body);

/// A point of a surface may lie so far beneath it, of the radius of the bounding sphere.
constexpr double surface_slack = 1e-4;

/// Whether the body's own surface does not hide its point `point_m` (body frame) from the camera.
[[nodiscard]] bool faces_camera(const TruthScene& scene, const TruthState& state, std::size_t body,
                                Vec3 point_m);

/// Whether the centre of the Sun is seen from a point of the surface of body `body`, body frame, over all
/// bodies. False without a Sun.
[[nodiscard]] bool is_lit(const TruthScene& scene, const TruthState& state, std::size_t body, Vec3 point_m);

/// From the camera to a point of a body (body frame), camera axes, m.
[[nodiscard]] inline Vec3 towards_point(const TruthState& state, std::size_t body, Vec3 point_m) {
    return state.camera_from_inertial * (to_parent(state.bodies[body], point_m) - state.camera.position_m);
}

} // namespace obscura::renderer
