// SPDX-License-Identifier: Apache-2.0
// Lines of sight for the truth table: what hides an object from the camera or from the Sun.
#pragma once

#include "renderer/truth/row_states.hpp"

#include <cstddef>
#include <optional>
#include <span>

namespace obscura::renderer {

/// No body.
constexpr std::size_t no_body = static_cast<std::size_t>(-1);

/// Whether a body other than `but` lies in a direction (camera axes, any length) nearer than `range_m`.
[[nodiscard]] bool is_hidden(const TruthScene& scene, const TruthState& state, Vec3 direction, double range_m,
                             std::size_t but = no_body);

/// Level of detail of a terrain, as the frame shows it; its cells are 0 for other shapes. Of use while the
/// pins of Renderer::list_truth() last.
[[nodiscard]] DetailView detail_of(const TruthScene& scene, const TruthState& state, std::size_t body);

/// How far a point of a surface may lie beneath it, m: landmarks that were given by position.
[[nodiscard]] double surface_slack_m(const TruthScene& scene, std::size_t body);

/// The outermost surface of a body in a direction from its centre, or above a point of a plane; empty: none.
[[nodiscard]] std::optional<Vec3> surface_point(const TruthScene& scene, const TruthState& state,
                                                std::size_t body, Vec3 towards);

/// The same for some directions, in packets.
void find_surface_points(const TruthScene& scene, const TruthState& state, std::size_t body,
                         std::span<const Vec3> towards, std::span<std::optional<Vec3>> points);

/// As faces_camera() for the cameras of some states, in packets; at the level of detail of the middle one.
void face_cameras(const TruthScene& scene, std::span<const TruthState* const> states, std::size_t body,
                  Vec3 point_m, double slack_m, std::span<bool> faces);

/// Whether the body's own surface does not hide its point `point_m` (body frame) from the camera.
[[nodiscard]] bool faces_camera(const TruthScene& scene, const TruthState& state, std::size_t body,
                                Vec3 point_m, double slack_m);

/// Whether the centre of the Sun is seen from a point of the surface of body `body`, body frame, over all
/// bodies. False without a Sun.
[[nodiscard]] bool is_lit(const TruthScene& scene, const TruthState& state, std::size_t body, Vec3 point_m,
                          double slack_m);

/// From the camera to a point of a body (body frame), camera axes, m: as long as the light's path.
[[nodiscard]] inline Vec3 towards_point(const TruthState& state, std::size_t body, Vec3 point_m) {
    return state.camera_from_inertial * state.bodies[body].towards(state.camera.position_m, point_m);
}

} // namespace obscura::renderer
