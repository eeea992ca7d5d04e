// SPDX-License-Identifier: Apache-2.0
// Bodies that hang on bodies: where each is in the inertial frame.
#pragma once

#include "renderer/world/row_state.hpp"

#include <span>

namespace obscura::renderer {

/// The inertial pose of a body: its motion and its joint, in its parent's frame, and so on up to a body
/// without a parent. The parents must form no circle (renderer/scene/scene_tree.hpp).
[[nodiscard]] Pose body_pose(std::span<const BuiltBody> bodies, std::size_t index, double time_s);

/// The same for the scene's camera and a lamp, which may hang on bodies. Neither allocates.
[[nodiscard]] Pose camera_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s);
[[nodiscard]] Pose lamp_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                             const scene::Lamp& lamp, double time_s);

} // namespace obscura::renderer
