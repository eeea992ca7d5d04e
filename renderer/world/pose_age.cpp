// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/pose_age.hpp"

#include "renderer/scene/scene_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <functional>

namespace obscura::renderer {
namespace {

double age_s(const scene::Motion& motion, double time_s) noexcept {
    Pose pose;
    if (motion.live && motion.live->at(time_s, pose)) return motion.live->age_s(time_s);
    return file_ages(motion, time_s).largest_s();
}

/// Calls `visit` with a name for people and the motion of all that has one in files.
void visit_motions(const scene::Scene& scene,
                   const std::function<void(const std::string&, const scene::Motion&)>& visit) {
    visit("the camera", scene.camera.motion);
    for (const scene::Body& body : scene.bodies)
        visit(fmt::format("\"{}\"", body.name), body.motion);
    for (const scene::Lamp& lamp : scene.lamps)
        visit(fmt::format("\"{}\"", lamp.name), lamp.motion);
}

} // namespace

scene::PoseAges file_ages(const scene::Motion& motion, double time_s) noexcept {
    if (motion.path) return motion.path->ages(time_s);
    if (motion.samples.size() < 2) return {};
    const double age_s =
        std::max({motion.samples.front().time_s - time_s, time_s - motion.samples.back().time_s, 0.0});
    return {age_s, age_s};
}

std::string AgedPoses::text() const {
    double first_s = motion->samples.front().time_s, last_s = motion->samples.back().time_s;
    if (motion->path) {
        const std::vector<double> times = motion->path->times_s();
        first_s = times.empty() ? time_s : times.front();
        last_s = times.empty() ? time_s : times.back();
    }
    // In a gap, or where only the other of the two is known, the ends say nothing.
    const std::string span =
        first_s <= time_s && time_s <= last_s ? "" : fmt::format(" ({:.6g} s to {:.6g} s)", first_s, last_s);
    return fmt::format("the {} are known for other times{}: at scene time {:.6g} s they are {:.4g} s away, "
                       "and it is held or extrapolated",
                       key, span, time_s, age_s);
}

std::vector<AgedPoses> aged_poses(const scene::Scene& scene, double time_s) {
    std::vector<AgedPoses> all;
    visit_motions(scene, [&](const std::string& name, const scene::Motion& motion) {
        const scene::PoseAges ages = file_ages(motion, time_s);
        const bool position = ages.position_s > 0, attitude = ages.attitude_s > 0 && !motion.aim;
        if (!position && !attitude) return;
        const char* const what = !attitude ? "positions" : !position ? "attitudes" : "poses";
        all.push_back({fmt::format("{} of {}", what, name),
                       std::max(position ? ages.position_s : 0.0, attitude ? ages.attitude_s : 0.0), time_s,
                       &motion});
    });
    return all;
}

std::vector<std::string> instant_attitudes(const scene::Scene& scene) {
    std::vector<std::string> all;
    visit_motions(scene, [&](const std::string& name, const scene::Motion& motion) {
        if (!motion.path || motion.aim) return;
        const std::vector<double> times = motion.path->attitude_instants_s();
        if (times.empty()) return;
        const std::string when = times.size() == 1
                                     ? fmt::format("one instant only, scene time {:.6g} s", times.front())
                                     : fmt::format("{} instants only, scene time {:.6g} s to {:.6g} s",
                                                   times.size(), times.front(), times.back());
        all.push_back(fmt::format(
            "the attitude of {} is known at {}: at other times it is held or extrapolated", name, when));
    });
    return all;
}

double body_pose_age_s(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t index,
                       double time_s) noexcept {
    double largest_s = 0;
    for (auto i = static_cast<std::int32_t>(index); i != scene::no_parent;
         i = bodies[static_cast<std::size_t>(i)].parent) {
        if (i == scene::camera_parent) return std::max(largest_s, camera_pose_age_s(scene, bodies, time_s));
        largest_s = std::max(largest_s, age_s(bodies[static_cast<std::size_t>(i)].motion, time_s));
    }
    return largest_s;
}

double camera_pose_age_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                         double time_s) noexcept {
    const double own_s = age_s(scene.camera.motion, time_s);
    const std::int32_t parent =
        scene.camera.parent.empty() ? -1 : scene::index_of(scene.bodies, scene.camera.parent);
    return parent < 0
               ? own_s
               : std::max(own_s, body_pose_age_s(scene, bodies, static_cast<std::size_t>(parent), time_s));
}

} // namespace obscura::renderer
