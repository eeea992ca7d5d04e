// SPDX-License-Identifier: Apache-2.0
// Ages of poses: how far an instant lies beyond the poses that are known.
#pragma once

#include "renderer/world/row_state.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace obscura::renderer {

/// Time by which `time_s` is later than the newest pose that the camera's motion has received, or outside the
/// times of its file; the largest of it and its parents. 0: between poses, or constant. Real-time safe.
[[nodiscard]] double camera_pose_age_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                       double time_s) noexcept;
/// Ages of a motion's poses from files at `time_s`, without its parents. Not of received ones.
[[nodiscard]] scene::PoseAges file_ages(const scene::Motion& motion, double time_s) noexcept;
/// Camera, body or lamp whose positions or attitudes from files are not known for an instant.
struct AgedPoses {
    std::string key; ///< names it and what is not known: "poses of the camera"
    double age_s = 0;
    double time_s = 0;
    const scene::Motion* motion = nullptr; ///< of the scene

    /// One line for people, without a full stop.
    [[nodiscard]] std::string text() const;
};
/// All such things of `scene`, which outlives them, at `time_s`. An aim stands for the attitudes of its file.
[[nodiscard]] std::vector<AgedPoses> aged_poses(const scene::Scene& scene, double time_s);
/// Cameras, bodies and lamps whose attitudes from files are known at instants only, as aged_poses(): one line
/// of text for each, without a full stop.
[[nodiscard]] std::vector<std::string> instant_attitudes(const scene::Scene& scene);
/// As camera_pose_age_s(), of a body.
[[nodiscard]] double body_pose_age_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                                     std::size_t index, double time_s) noexcept;

} // namespace obscura::renderer
