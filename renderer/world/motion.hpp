// SPDX-License-Identifier: Apache-2.0
// Interpolation of motions at an instant of scene time.
#pragma once

#include "core/time.hpp"
#include "renderer/scene/scene.hpp"

#include <string>

namespace obscura::renderer {

/// Pose of a motion at `time_s`: position linear and attitude slerp between samples, the end poses held
/// outside, then rotated by the spin about the moving frame's own axis (angle = rate x time_s). The live pose
/// instead, if there is one.
[[nodiscard]] Pose pose_at(const scene::Motion& motion, double time_s);

/// As pose_at(), without the live pose.
[[nodiscard]] Pose scripted_pose(const scene::Motion& motion, double time_s);

/// Derivative of the position of scripted_pose(), m/s: 0 where it holds; at a corner that of what follows, at
/// the last sample that of what came before.
[[nodiscard]] Vec3 scripted_velocity_m_s(const scene::Motion& motion, double time_s);

/// Throws ConfigError that names `place` unless there is a sample, times increase and all numbers are finite.
void validate(const scene::Motion& motion, const std::string& place);

} // namespace obscura::renderer
