// SPDX-License-Identifier: Apache-2.0
// Where things are at an instant of scene time.
#pragma once

#include "core/time.hpp"
#include "renderer/scene/scene.hpp"

#include <string>

namespace obscura::renderer {

/// The pose of a motion at `time_s`: position linear and attitude slerp between samples, the end poses held
/// outside, then turned by the spin about the thing's own axis (angle = rate x time_s).
[[nodiscard]] Pose pose_at(const scene::Motion& motion, double time_s);

/// The same without what comes from outside.
[[nodiscard]] Pose scripted_pose(const scene::Motion& motion, double time_s);

/// Throws ConfigError, naming `place`, unless there is a sample, times increase and everything is finite.
void validate(const scene::Motion& motion, const std::string& place);

} // namespace obscura::renderer
