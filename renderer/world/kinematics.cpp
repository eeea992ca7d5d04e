// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/kinematics.hpp"

#include "renderer/camera/aberration.hpp"
#include "renderer/scene/central_difference.hpp"
#include "renderer/scene/scene_tree.hpp"
#include "renderer/scene/sky_object.hpp"
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

/// Transforms `pose` from the frame of `motion`, whose parent is body `parent`, to the inertial frame.
Pose inertial_pose(std::span<const BuiltBody> bodies, const scene::Motion& motion, std::int32_t parent,
                   Pose pose, double time_s) {
    const scene::Motion* inner = &motion;
    for (std::int32_t up = parent; up >= 0; up = bodies[static_cast<std::size_t>(up)].parent) {
        if (inner->inertial_axes) {
            const Pose place = body_pose(bodies, static_cast<std::size_t>(up), time_s);
            return {place.position_m + pose.position_m, pose.orientation};
        }
        const BuiltBody& body = bodies[static_cast<std::size_t>(up)];
        const Pose outer = pose_in_parent(body.motion, body.joint, time_s);
        pose = {to_parent(outer, pose.position_m), outer.orientation * pose.orientation};
        inner = &body.motion;
    }
    return pose;
}

/// Inertial pose of a motion on a parent. `scene.bodies` and `bodies` have the same order.
Pose pose_on_parent(const scene::Scene& scene, std::span<const BuiltBody> bodies, const std::string& parent,
                    const scene::Motion& motion, const scene::Joint& joint, double time_s) {
    const Pose pose = pose_in_parent(motion, joint, time_s);
    if (parent.empty()) return pose;
    return inertial_pose(bodies, motion, scene::index_of(scene.bodies, parent), pose, time_s);
}

/// Velocity of `motion` with `joint` in the frame of its parent.
Vec3 velocity_in_parent(const scene::Motion& motion, const scene::Joint& joint, double time_s) {
    Pose live;
    if ((motion.live && motion.live->at(time_s, live)) || joint.kind == scene::Joint::Kind::slide)
        return scene::differenced_velocity_m_s(
            [&](double t) { return pose_in_parent(motion, joint, t).position_m; }, time_s);
    return scripted_velocity_m_s(motion, time_s);
}

/// Inertial velocity of `motion` on body `parent`. Positions and attitudes are taken apart, so that an
/// attitude that is known for an instant only does not stop what moves.
Vec3 inertial_velocity_m_s(std::span<const BuiltBody> bodies, const scene::Motion& motion,
                           const scene::Joint& joint, std::int32_t parent, double time_s) {
    Vec3 velocity = velocity_in_parent(motion, joint, time_s);
    if (parent < 0) return velocity;
    const auto up = static_cast<std::size_t>(parent);
    if (!motion.inertial_axes) {
        const auto turned = [&](double at_s, Vec3 v) {
            return rotate(body_pose(bodies, up, at_s).orientation, v);
        };
        velocity = turned(time_s, velocity);
        if (const Vec3 at_m = pose_in_parent(motion, joint, time_s).position_m; length_squared(at_m) > 0)
            velocity =
                velocity + scene::differenced_velocity_m_s([&](double t) { return turned(t, at_m); }, time_s);
    }
    return velocity + body_velocity_m_s(bodies, up, time_s);
}

/// Inertial pose of the frame that the poses of `motion` on `parent` refer to.
Pose frame_of(const scene::Scene& scene, std::span<const BuiltBody> bodies, const std::string& parent,
              const scene::Motion& motion, double time_s) {
    if (parent.empty()) return {};
    Pose frame = body_pose(bodies, static_cast<std::size_t>(scene::index_of(scene.bodies, parent)), time_s);
    if (motion.inertial_axes) frame.orientation = {};
    return frame;
}

/// The aim of a motion at `time_s`; null: it has none, or a pose received at run time overrides it.
const scene::Aim* aim_of(const scene::Motion& motion, double time_s) {
    Pose live;
    if (!motion.aim || (motion.live && motion.live->at(time_s, live))) return nullptr;
    return &*motion.aim;
}

/// Target of `aim` in the inertial frame. `frame` is that of the motion; bodies are seen from `from_m` with
/// the scene's correction for light time if `seen`.
Vec3 target_of(const scene::Scene& scene, std::span<const BuiltBody> bodies, const scene::Aim& aim,
               const Pose& frame, Vec3 from_m, bool seen, double time_s) {
    if (aim.body.empty()) return to_parent(frame, aim.point_m);
    const std::int32_t index = scene::index_of(scene.bodies, aim.body);
    if (index < 0) return scene.sun.position_at(time_s);
    const auto body = static_cast<std::size_t>(index);
    return seen ? apparent_pose(scene, bodies, body, from_m, time_s).position_m
                : body_pose(bodies, body, time_s).position_m;
}

/// As look_along(), with another direction for `up` where the two are parallel: see scene::Aim.
Quat look_along_any(Vec3 direction, Vec3 up) {
    const auto fits = [&](Vec3 v) {
        return length(cross(direction, v)) > 1e-6 * length(direction) * length(v);
    };
    if (fits(up)) return look_along(direction, up);
    return look_along(direction, fits({1, 0, 0}) ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
}

/// Orientation of which the z axis has the inertial `direction`; `otherwise` if that is zero.
Quat aimed(const scene::Aim& aim, const Pose& frame, Vec3 direction, Quat otherwise) {
    if (!(length(direction) > 0)) return otherwise;
    return frame.orientation * look_along_any(rotate(conjugate(frame.orientation), direction), aim.up);
}

} // namespace

Pose body_pose(std::span<const BuiltBody> bodies, std::size_t index, double time_s) {
    const BuiltBody& body = bodies[index];
    return inertial_pose(bodies, body.motion, body.parent, pose_in_parent(body.motion, body.joint, time_s),
                         time_s);
}

Vec3 body_velocity_m_s(std::span<const BuiltBody> bodies, std::size_t index, double time_s) {
    const BuiltBody& body = bodies[index];
    return inertial_velocity_m_s(bodies, body.motion, body.joint, body.parent, time_s);
}

Vec3 camera_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s) {
    const scene::Camera& camera = scene.camera;
    if (length(camera.velocity_m_s) > 0) return camera.velocity_m_s;
    const std::int32_t parent = camera.parent.empty() ? -1 : scene::index_of(scene.bodies, camera.parent);
    return inertial_velocity_m_s(bodies, camera.motion, camera.joint, parent, time_s);
}

Vec3 lamp_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies, const scene::Lamp& lamp,
                       double time_s) {
    const std::int32_t parent = lamp.parent.empty() ? -1 : scene::index_of(scene.bodies, lamp.parent);
    return inertial_velocity_m_s(bodies, lamp.motion, lamp.joint, parent, time_s);
}

Pose camera_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s) {
    const scene::Camera& camera = scene.camera;
    Pose pose = pose_on_parent(scene, bodies, camera.parent, camera.motion, camera.joint, time_s);
    const scene::Aim* aim = aim_of(camera.motion, time_s);
    if (aim == nullptr) return pose;
    const Pose frame = frame_of(scene, bodies, camera.parent, camera.motion, time_s);
    Vec3 direction = target_of(scene, bodies, *aim, frame, pose.position_m, true, time_s) - pose.position_m;
    if (scene.aberration && length(direction) > 0)
        direction =
            aberrate(normalized(direction), camera_velocity_m_s(scene, bodies, time_s) / light_speed_m_s);
    pose.orientation = aimed(*aim, frame, direction, pose.orientation);
    return pose;
}

Pose lamp_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, const scene::Lamp& lamp,
               double time_s) {
    Pose pose = pose_on_parent(scene, bodies, lamp.parent, lamp.motion, lamp.joint, time_s);
    const scene::Aim* aim = aim_of(lamp.motion, time_s);
    if (aim == nullptr) return pose;
    const Pose frame = frame_of(scene, bodies, lamp.parent, lamp.motion, time_s);
    const Vec3 target = target_of(scene, bodies, *aim, frame, pose.position_m, false, time_s);
    pose.orientation = aimed(*aim, frame, target - pose.position_m, pose.orientation);
    return pose;
}

Vec3 point_position(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                    const scene::SkyObject& object, double time_s) {
    return pose_on_parent(scene, bodies, object.parent, object.motion, {}, time_s).position_m;
}

} // namespace obscura::renderer
