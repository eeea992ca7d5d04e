// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/pose_age.hpp"

#include "renderer/scene/scene_tree.hpp"

#include <algorithm>

namespace obscura::renderer {
namespace {

double age_s(const scene::Motion& motion, double time_s) noexcept {
    Pose pose;
    if (motion.live && motion.live->at(time_s, pose)) return motion.live->age_s(time_s);
    if (motion.path) return motion.path->age_s(time_s);
    if (motion.samples.size() < 2) return 0;
    return std::max({motion.samples.front().time_s - time_s, time_s - motion.samples.back().time_s, 0.0});
}

} // namespace

double body_pose_age_s(std::span<const BuiltBody> bodies, std::size_t index, double time_s) noexcept {
    double largest_s = 0;
    for (auto i = static_cast<std::int32_t>(index); i >= 0; i = bodies[static_cast<std::size_t>(i)].parent)
        largest_s = std::max(largest_s, age_s(bodies[static_cast<std::size_t>(i)].motion, time_s));
    return largest_s;
}

double camera_pose_age_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                         double time_s) noexcept {
    const double own_s = age_s(scene.camera.motion, time_s);
    const std::int32_t parent =
        scene.camera.parent.empty() ? -1 : scene::index_of(scene.bodies, scene.camera.parent);
    return parent < 0 ? own_s
                      : std::max(own_s, body_pose_age_s(bodies, static_cast<std::size_t>(parent), time_s));
}

} // namespace obscura::renderer
