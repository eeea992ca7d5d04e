// SPDX-License-Identifier: Apache-2.0
// Forward kinematics: poses of bodies, camera and lamps in the inertial frame through parents and joints.
#pragma once

#include "renderer/world/row_state.hpp"

#include <span>

namespace obscura::renderer {

/// Inertial pose of a body: its motion and joint in the parent's frame, and so on up to a body without a
/// parent, or to the camera. The parents must not be circular (renderer/scene/scene_tree.hpp). `bodies` are
/// in the order of the scene's.
[[nodiscard]] Pose body_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t index,
                             double time_s);

/// As body_pose(), of the camera or a lamp, with the aim of its motion. Neither
/// allocates.
[[nodiscard]] Pose camera_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s);
[[nodiscard]] Pose lamp_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                             const scene::Lamp& lamp, double time_s);

/// Inertial position of a sky object that is a point in space.
[[nodiscard]] Vec3 point_position(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                  const scene::SkyObject& object, double time_s);

/// Inertial velocity of a body's origin, m/s: the derivative of its motion's own interpolation, 0 where that
/// holds; attitudes that hold do not matter. Turns of parents, slides and poses from outside are differenced
/// over 0.1 s.
[[nodiscard]] Vec3 body_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                     std::size_t index, double time_s);

/// As body_velocity_m_s(), of a lamp.
[[nodiscard]] Vec3 lamp_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                     const scene::Lamp& lamp, double time_s);
/// Velocity of the camera in the inertial frame for aberration: its own key, or as body_velocity_m_s().
[[nodiscard]] Vec3 camera_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                       double time_s);

} // namespace obscura::renderer
