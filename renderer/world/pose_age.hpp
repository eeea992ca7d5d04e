// SPDX-License-Identifier: Apache-2.0
// Ages of poses: how far an instant lies beyond the poses that are known.
#pragma once

#include "renderer/world/row_state.hpp"

#include <cstddef>
#include <span>

namespace obscura::renderer {

/// Time by which `time_s` is later than the newest pose that the camera's motion has received, or outside the
/// times of its file; the largest of it and its parents. 0: between poses, or constant. Real-time safe.
[[nodiscard]] double camera_pose_age_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                       double time_s) noexcept;
/// As camera_pose_age_s(), of a body.
[[nodiscard]] double body_pose_age_s(std::span<const BuiltBody> bodies, std::size_t index,
                                     double time_s) noexcept;

} // namespace obscura::renderer
