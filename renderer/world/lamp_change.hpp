// SPDX-License-Identifier: Apache-2.0
// How far the light of lamps moves over the bodies from one state of the scene to another.
#pragma once

#include "core/camera/frame.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/world/row_state.hpp"

#include <span>
#include <vector>

namespace obscura::renderer {

/// Upper bound, in pixels, of the motion over a body of a beam, or of a shadow that the body casts on itself,
/// between two states of the scene with the poses of its lamps: the way of the lamp past the body's centre,
/// its turn at the far side of the body, and the way of shadows as long as the body. Shadows on other bodies
/// are assumed to move no faster, ways are those across the light's direction, and the motion of the bodies
/// themselves is that of change_px(). Infinite if a GroundTruth has no room for all bodies, or the camera or
/// a lamp is within the sphere about a body.
[[nodiscard]] double lamp_change_px(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                                    const Projection& projection, const GroundTruth& from,
                                    std::span<const Pose> from_lamps, const GroundTruth& to,
                                    std::span<const Pose> to_lamps);

} // namespace obscura::renderer
