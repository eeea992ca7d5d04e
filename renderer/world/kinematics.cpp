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

/// As camera_velocity_m_s(), by the camera's motion alone.
Vec3 moving_camera_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s);

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

/// `pose` in the frame that `outer` is in.
Pose in_parent(const Pose& outer, const Pose& pose) {
    return {to_parent(outer, pose.position_m), outer.orientation * pose.orientation};
}

/// Inertial pose of body `index` of the scene, or of the camera.
Pose thing_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::int32_t index,
                double time_s) {
    return index == scene::camera_parent ? camera_pose(scene, bodies, time_s)
                                         : body_pose(scene, bodies, static_cast<std::size_t>(index), time_s);
}

/// Transforms `pose` from the frame of `motion`, whose parent is `parent`, to the inertial frame.
Pose inertial_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, const scene::Motion& motion,
                   std::int32_t parent, Pose pose, double time_s) {
    const scene::Motion* inner = &motion;
    for (std::int32_t up = parent; up != scene::no_parent;) {
        if (inner->inertial_axes || up == scene::camera_parent) {
            const Pose outer = thing_pose(scene, bodies, up, time_s);
            if (inner->inertial_axes) return {outer.position_m + pose.position_m, pose.orientation};
            return in_parent(outer, pose);
        }
        const BuiltBody& body = bodies[static_cast<std::size_t>(up)];
        const Pose outer = pose_in_parent(body.motion, body.joint, time_s);
        pose = in_parent(outer, pose);
        inner = &body.motion;
        up = body.parent;
    }
    return pose;
}

/// Number of a parent that is known by name, which must be in the scene.
std::int32_t parent_number(const scene::Scene& scene, const std::string& parent) {
    return parent.empty()                 ? scene::no_parent
           : parent == scene::camera_name ? scene::camera_parent
                                          : scene::index_of(scene.bodies, parent);
}

/// Inertial pose of a motion on a parent. `scene.bodies` and `bodies` have the same order.
Pose pose_on_parent(const scene::Scene& scene, std::span<const BuiltBody> bodies, const std::string& parent,
                    const scene::Motion& motion, const scene::Joint& joint, double time_s) {
    return inertial_pose(scene, bodies, motion, parent_number(scene, parent),
                         pose_in_parent(motion, joint, time_s), time_s);
}

/// Velocity of `motion` with `joint` in the frame of its parent.
Vec3 velocity_in_parent(const scene::Motion& motion, const scene::Joint& joint, double time_s) {
    Pose live;
    if ((motion.live && motion.live->at(time_s, live)) || joint.kind == scene::Joint::Kind::slide)
        return scene::differenced_velocity_m_s(
            [&](double t) { return pose_in_parent(motion, joint, t).position_m; }, time_s);
    return scripted_velocity_m_s(motion, time_s);
}

/// Inertial velocity of `motion` on `parent`. Positions and attitudes are taken apart, so that an attitude
/// that is known for an instant only does not stop what moves.
Vec3 inertial_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                           const scene::Motion& motion, const scene::Joint& joint, std::int32_t parent,
                           double time_s) {
    Vec3 velocity = velocity_in_parent(motion, joint, time_s);
    if (parent == scene::no_parent) return velocity;
    if (!motion.inertial_axes) {
        const auto turned = [&](double at_s, Vec3 v) {
            return rotate(thing_pose(scene, bodies, parent, at_s).orientation, v);
        };
        velocity = turned(time_s, velocity);
        if (const Vec3 at_m = pose_in_parent(motion, joint, time_s).position_m; length_squared(at_m) > 0)
            velocity =
                velocity + scene::differenced_velocity_m_s([&](double t) { return turned(t, at_m); }, time_s);
    }
    return velocity + (parent == scene::camera_parent
                           ? moving_camera_velocity_m_s(scene, bodies, time_s)
                           : body_velocity_m_s(scene, bodies, static_cast<std::size_t>(parent), time_s));
}

Vec3 moving_camera_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s) {
    const scene::Camera& camera = scene.camera;
    return inertial_velocity_m_s(scene, bodies, camera.motion, camera.joint,
                                 parent_number(scene, camera.parent), time_s);
}

/// Inertial pose of the frame that the poses of `motion` on `parent` refer to.
Pose frame_of(const scene::Scene& scene, std::span<const BuiltBody> bodies, const std::string& parent,
              const scene::Motion& motion, double time_s) {
    if (parent.empty()) return {};
    Pose frame = thing_pose(scene, bodies, parent_number(scene, parent), time_s);
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
    if (!seen) return to_parent(body_pose(scene, bodies, body, time_s), aim.point_m);
    if (aim.point_m == Vec3{}) return apparent_pose(scene, bodies, body, from_m, time_s).position_m;
    return from_m + apparent_body(scene, bodies, body, from_m, time_s).towards(from_m, aim.point_m);
}

/// As look_along(), with another direction for `up` where the two are parallel: see scene::Aim. `direction`
/// is not zero, and its square a number. Real-time safe.
Quat look_along_any(Vec3 direction, Vec3 up) noexcept {
    const auto fits = [&](Vec3 v) {
        return length(cross(direction, v)) > 1e-6 * length(direction) * length(v);
    };
    if (fits(up)) return look_along(direction, up);
    return look_along(direction, fits({1, 0, 0}) ? Vec3{1, 0, 0} : Vec3{0, 1, 0});
}

/// Orientation of which the z axis has the inertial `direction`; `otherwise`, the attitude without the aim,
/// if that is zero.
Quat aimed(const scene::Aim& aim, const Pose& frame, Vec3 direction, Quat otherwise) {
    if (!(length(direction) > 0) || !std::isfinite(length(direction))) return otherwise;
    const Quat axes = aim.own_axes ? otherwise : frame.orientation;
    return axes * look_along_any(rotate(conjugate(axes), direction), aim.up);
}

/// Pose of the camera without its vibration.
Pose still_camera_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s) {
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

} // namespace

Pose body_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t index,
               double time_s) {
    const BuiltBody& body = bodies[index];
    return inertial_pose(scene, bodies, body.motion, body.parent,
                         pose_in_parent(body.motion, body.joint, time_s), time_s);
}

Vec3 body_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t index,
                       double time_s) {
    const BuiltBody& body = bodies[index];
    return inertial_velocity_m_s(scene, bodies, body.motion, body.joint, body.parent, time_s);
}

Vec3 camera_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s) {
    const scene::Camera& camera = scene.camera;
    if (length(camera.velocity_m_s) > 0) return camera.velocity_m_s;
    return moving_camera_velocity_m_s(scene, bodies, time_s);
}

Vec3 lamp_velocity_m_s(const scene::Scene& scene, std::span<const BuiltBody> bodies, const scene::Lamp& lamp,
                       double time_s) {
    return inertial_velocity_m_s(scene, bodies, lamp.motion, lamp.joint, parent_number(scene, lamp.parent),
                                 time_s);
}

Pose camera_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, double time_s) {
    Pose pose = still_camera_pose(scene, bodies, time_s);
    if (scene.camera.vibration == nullptr) return pose;
    const models::SmallMotion motion = scene.camera.vibration->at(time_s);
    pose.position_m = pose.position_m + rotate(pose.orientation, motion.offset_m);
    if (const double angle = length(motion.rotation_rad); angle > 0)
        pose.orientation = pose.orientation * axis_angle(motion.rotation_rad, angle);
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
