// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/kinematics.hpp"

#include "renderer/scene/scene_tree.hpp"
#include "renderer/world/motion.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

double joint_value(const scene::Joint& joint, double time_s) {
    const auto& s = joint.samples;
    if (s.empty()) return 0;
    if (time_s <= s.front().time_s) return s.front().value;
    if (time_s >= s.back().time_s) return s.back().value;
    const auto after = std::upper_bound(s.begin(), s.end(), time_s,
                                        [](double t, const scene::Joint::Sample& x) { return t < x.time_s; });
    const auto before = after - 1;
    const double share = (time_s - before->time_s) / (after->time_s - before->time_s);
    return before->value + share * (after->value - before->value);
}

/// The joint's value (rad or m) in a live pose; the rest of that pose's motion is discarded.
double value_in(const scene::Joint& joint, const Pose& mount, const Pose& live) {
    const Vec3 axis = normalized(joint.axis);
    if (joint.kind == scene::Joint::Kind::slide)
        return dot(rotate(conjugate(mount.orientation), live.position_m - mount.position_m), axis);
    const Quat turn = conjugate(mount.orientation) * live.orientation;
    return 2 * std::atan2(turn.x * axis.x + turn.y * axis.y + turn.z * axis.z, turn.w);
}

Pose pose_in_parent(const scene::Motion& motion, const scene::Joint& joint, double time_s) {
    if (joint.kind == scene::Joint::Kind::fixed) return pose_at(motion, time_s);
    Pose pose = scripted_pose(motion, time_s);
    Pose live;
    const bool from_outside = motion.live && motion.live->at(time_s, live);
    const double value = from_outside ? value_in(joint, pose, live) : joint_value(joint, time_s);
    if (joint.kind == scene::Joint::Kind::hinge)
        pose.orientation = pose.orientation * axis_angle(joint.axis, value);
    else
        pose.position_m = pose.position_m + rotate(pose.orientation, normalized(joint.axis) * value);
    return pose;
}

/// Transforms `pose` from the frame of body `parent` to the inertial frame.
Pose inertial_pose(std::span<const BuiltBody> bodies, std::int32_t parent, Pose pose, double time_s) {
    for (std::int32_t up = parent; up >= 0; up = bodies[static_cast<std::size_t>(up)].parent) {
        const BuiltBody& body = bodies[static_cast<std::size_t>(up)];
        const Pose outer = pose_in_parent(body.motion, body.joint, time_s);
        pose = {to_parent(outer, pose.position_m), outer.orientation * pose.orientation};
    }
    return pose;
}

/// Inertial pose of a motion on a parent. `scene.bodies` and `bodies` have the same order.
Pose pose_on_parent(const scene::Scene& scene, std::span<const BuiltBody> bodies, const std::string& parent,
                    const scene::Motion& motion, const scene::Joint& joint, double time_s) {
    const Pose pose = pose_in_parent(motion, joint, time_s);
    if (parent.empty()) return pose;
    return inertial_pose(bodies, scene::index_of(scene.bodies, parent), pose, time_s);
}

} // namespace

Pose body_pose(std::span<const BuiltBody> bodies, std::size_t index, double time_s) {
    const BuiltBody& body = bodies[index];
    return inertial_pose(bodies, body.parent, pose_in_parent(body.motion, body.joint, time_s), time_s);
}

Pose camera_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s) {
    const scene::Camera& camera = scene.camera;
    return pose_on_parent(scene, bodies, camera.parent, camera.motion, camera.joint, time_s);
}

Pose lamp_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, const scene::Lamp& lamp,
               double time_s) {
    return pose_on_parent(scene, bodies, lamp.parent, lamp.motion, lamp.joint, time_s);
}

} // namespace obscura::renderer
