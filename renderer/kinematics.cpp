#include "renderer/kinematics.hpp"

#include "renderer/motion.hpp"

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

/// The joint's value in a pose that came from outside: of any other movement nothing is kept.
double value_in(const scene::Joint& joint, const Pose& mount, const Pose& live) {
    const Vec3 axis = normalized(joint.axis);
    if (joint.kind == scene::Joint::Kind::slide)
        return dot(rotate(conjugate(mount.orientation), live.position_m - mount.position_m), axis);
    const Quat turn = conjugate(mount.orientation) * live.orientation;
    return 2 * std::atan2(turn.x * axis.x + turn.y * axis.y + turn.z * axis.z, turn.w);
}

Pose pose_in_parent(const BuiltBody& body, double time_s) {
    if (body.joint.kind == scene::Joint::Kind::fixed) return pose_at(body.motion, time_s);
    Pose pose = scripted_pose(body.motion, time_s);
    Pose live;
    const bool from_outside = body.motion.live && body.motion.live->at(time_s, live);
    const double value = from_outside ? value_in(body.joint, pose, live) : joint_value(body.joint, time_s);
    if (body.joint.kind == scene::Joint::Kind::hinge)
        pose.orientation = pose.orientation * axis_angle(body.joint.axis, value);
    else
        pose.position_m = pose.position_m + rotate(pose.orientation, normalized(body.joint.axis) * value);
    return pose;
}

} // namespace

Pose body_pose(std::span<const BuiltBody> bodies, std::size_t index, double time_s) {
    Pose pose = pose_in_parent(bodies[index], time_s);
    for (std::int32_t up = bodies[index].parent; up >= 0; up = bodies[static_cast<std::size_t>(up)].parent) {
        const Pose outer = pose_in_parent(bodies[static_cast<std::size_t>(up)], time_s);
        pose = {to_parent(outer, pose.position_m), outer.orientation * pose.orientation};
    }
    return pose;
}

} // namespace obscura::renderer
