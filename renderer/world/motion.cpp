// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/motion.hpp"

#include "core/error.hpp"
#include "core/pose_range.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::renderer {

Pose pose_at(const scene::Motion& motion, double time_s) {
    Pose pose;
    if (motion.live && motion.live->at(time_s, pose)) return pose;
    return scripted_pose(motion, time_s);
}

Pose scripted_pose(const scene::Motion& motion, double time_s) {
    const auto& samples = motion.samples;
    Pose pose;
    if (motion.path) {
        pose = motion.path->at(time_s);
    } else if (samples.size() == 1 || time_s <= samples.front().time_s) {
        pose = samples.front().pose;
    } else if (time_s >= samples.back().time_s) {
        pose = samples.back().pose;
    } else {
        const auto after = std::upper_bound(samples.begin(), samples.end(), time_s,
                                            [](double t, const scene::TimedPose& s) { return t < s.time_s; });
        const auto before = after - 1;
        pose = interpolate(before->pose, after->pose,
                           (time_s - before->time_s) / (after->time_s - before->time_s));
    }
    pose.orientation = normalized(pose.orientation);
    if (motion.spin_rate_rad_s != 0)
        pose.orientation = pose.orientation * axis_angle(motion.spin_axis, motion.spin_rate_rad_s * time_s);
    return pose;
}

Vec3 scripted_velocity_m_s(const scene::Motion& motion, double time_s) {
    if (motion.path) return motion.path->velocity_m_s(time_s);
    const auto& samples = motion.samples;
    if (samples.size() == 1 || time_s < samples.front().time_s || time_s > samples.back().time_s) return {};
    auto after = std::upper_bound(samples.begin(), samples.end(), time_s,
                                  [](double t, const scene::TimedPose& s) { return t < s.time_s; });
    if (after == samples.end()) --after;
    const auto before = after - 1;
    return (after->pose.position_m - before->pose.position_m) / (after->time_s - before->time_s);
}

void validate(const scene::Motion& motion, const std::string& place) {
    if (motion.samples.empty()) throw ConfigError(fmt::format("{}: no pose: at least one is wanted", place));
    for (std::size_t i = 0; i < motion.samples.size(); ++i) {
        const scene::TimedPose& s = motion.samples[i];
        const double q = norm(s.pose.orientation);
        if (!std::isfinite(s.time_s) || !std::isfinite(q))
            throw ConfigError(fmt::format("{}: pose {} is not finite", place, i + 1));
        if (const auto why = refusal_of_position(s.pose.position_m))
            throw ConfigError(fmt::format("{}: pose {}: {}", place, i + 1, *why));
        if (!(q > 1e-6))
            throw ConfigError(
                fmt::format("{}: orientation of pose {} is zero: a unit quaternion is wanted", place, i + 1));
        if (i > 0 && !(s.time_s > motion.samples[i - 1].time_s))
            throw ConfigError(
                fmt::format("{}: time of pose {} is not later than that of pose {}", place, i + 1, i));
    }
    if (motion.aim &&
        !(is_in_range(motion.aim->point_m) && is_finite(motion.aim->up) && length(motion.aim->up) > 0))
        throw ConfigError(
            fmt::format("{}: the aim needs a point within 1e15 m and an \"up\" that is not zero", place));
    if (const auto why = refusal_of_rate({motion.spin_rate_rad_s, 0, 0}))
        throw ConfigError(fmt::format("{}: the spin: {}", place, *why));
    if (!is_finite(motion.spin_axis) || (motion.spin_rate_rad_s != 0 && !(length(motion.spin_axis) > 0)))
        throw ConfigError(fmt::format("{}: the spin needs an axis that is not zero", place));
}

} // namespace obscura::renderer
