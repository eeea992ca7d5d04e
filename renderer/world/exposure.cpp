// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/exposure.hpp"

#include "renderer/scene/sky_object.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <span>

namespace obscura::renderer {
namespace {

constexpr double exposure_step_px = 0.5;

double exposure_angle(const Quat& a, const Quat& b) {
    // The sine of half the angle, from the difference: accurate for the smallest angles.
    const double sign = dot(a, b) < 0 ? -1 : 1;
    const Vec3 v{a.x - sign * b.x, a.y - sign * b.y, a.z - sign * b.z};
    const double w = a.w - sign * b.w;
    return 4 * std::asin(std::min(1.0, std::sqrt(dot(v, v) + w * w) / 2));
}

/// Apparent motion of a body from pose `from` to pose `to`, as an angle, without the rotation of the camera.
double body_angle(const Pose& camera_from, const Pose& camera_to, const Pose& from, const Pose& to,
                  double radius_m) {
    const Vec3 a = from.position_m - camera_from.position_m;
    const Vec3 b = to.position_m - camera_to.position_m;
    // Distance of the nearest point of the surface.
    const double nearest = std::max(std::min(length(a), length(b)) - radius_m, 0.01 * radius_m);
    if (!(nearest > 0)) return std::numeric_limits<double>::infinity();
    return (length(b - a) + radius_m * exposure_angle(from.orientation, to.orientation)) / nearest;
}

/// Largest apparent motion of a sky object, without the rotation of the camera.
double sky_motion_rad(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                      const std::array<double, 3>& times, const std::array<Pose, 3>& camera) {
    double max_rad = 0;
    for (const scene::SkyObject& object : *scene.sky_objects) {
        if (object.still() || object.kind == scene::SkyObject::Kind::galaxy) continue;
        if (object.kind == scene::SkyObject::Kind::star) {
            max_rad = std::max(max_rad, std::hypot(object.rate_rad_s[0], object.rate_rad_s[1]) *
                                            (times[2] - times[0]));
            continue;
        }
        double moved_rad = 0;
        std::array<Vec3, 3> to_object;
        for (std::size_t i = 0; i < 3; ++i) {
            to_object[i] = point_position(scene, bodies, object, times[i]) - camera[i].position_m;
            if (i > 0)
                moved_rad += std::atan2(length(cross(to_object[i - 1], to_object[i])),
                                        dot(to_object[i - 1], to_object[i]));
        }
        max_rad = std::max(max_rad, moved_rad);
    }
    return max_rad;
}

/// Apparent motion of a body along successive poses, without the rotation of the camera; 0 if it stays out of
/// the field, a cone of half angle `field_rad`.
double motion_in_field_rad(std::span<const Pose> camera, std::span<const Pose> body, double radius_m,
                           double field_rad) {
    double moved_rad = 0;
    for (std::size_t i = 0; i + 1 < body.size(); ++i)
        moved_rad += body_angle(camera[i], camera[i + 1], body[i], body[i + 1], radius_m);
    // It may cross the field between the poses.
    for (std::size_t i = 0; i < body.size(); ++i) {
        const Vec3 to_body = body[i].position_m - camera[i].position_m;
        const double distance = length(to_body);
        if (distance <= radius_m ||
            std::acos(std::clamp(dot(rotate(camera[i].orientation, {0, 0, 1}), to_body) / distance, -1.0,
                                 1.0)) < field_rad + moved_rad + std::asin(radius_m / distance))
            return moved_rad;
    }
    return 0;
}

} // namespace

double motion_px(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                 const Projection& projection, double reach_px, const RowTime& row) {
    if (row.exposure_ns() <= 0) return 0;
    const std::array times{to_seconds(row.reset.ns), to_seconds(row.mid().ns), to_seconds(row.read.ns)};
    std::array<Pose, 3> camera;
    for (std::size_t i = 0; i < 3; ++i)
        camera[i] = camera_pose(scene, bodies, times[i]);
    double turn_rad = exposure_angle(camera[0].orientation, camera[1].orientation) +
                      exposure_angle(camera[1].orientation, camera[2].orientation);
    // Three instants know nothing of a jitter between them.
    if (scene.camera.vibration) turn_rad += scene.camera.vibration->path_rad(times[0], times[2]);
    const double field_rad = projection.field_angle_rad(reach_px) + turn_rad;
    double max_rad = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        const double radius_m = bodies[b].shape->bounding_radius_m();
        std::array<Pose, 3> body;
        for (std::size_t i = 0; i < 3; ++i)
            body[i] = apparent_pose(scene, bodies, b, camera[i].position_m, times[i]);
        max_rad = std::max(max_rad, motion_in_field_rad(camera, body, radius_m, field_rad));
    }
    if (scene.sky_objects) max_rad = std::max(max_rad, sky_motion_rad(scene, bodies, times, camera));
    return (turn_rad + max_rad) / (projection.pixel_angle_rad() * scene.camera.pixel_flattening());
}

double change_px(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                 const Projection& projection, double reach_px, const GroundTruth& from,
                 const GroundTruth& to) {
    if (bodies.size() > max_truth_bodies) return std::numeric_limits<double>::infinity();
    const std::array camera{from.camera, to.camera};
    const double turn_rad = exposure_angle(camera[0].orientation, camera[1].orientation);
    const double field_rad = projection.field_angle_rad(reach_px) + turn_rad;
    double max_rad = 0;
    for (std::size_t b = 0; b < bodies.size(); ++b)
        max_rad =
            std::max(max_rad, motion_in_field_rad(camera, std::array{from.bodies[b].pose, to.bodies[b].pose},
                                                  bodies[b].shape->bounding_radius_m(), field_rad));
    return (max_rad + turn_rad) / (projection.pixel_angle_rad() * scene.camera.pixel_flattening());
}

Exposure Exposure::of(const RowTime& row, double motion_px, std::uint32_t most) {
    return {row, static_cast<std::uint32_t>(
                     std::clamp(std::ceil(motion_px / exposure_step_px), 1.0, static_cast<double>(most)))};
}

double Exposure::time_s(std::uint32_t i) const {
    // The middle is the instant in whole nanoseconds that the frame's ground truth states.
    if (instants == 1) return to_seconds(row.mid().ns);
    const double n = instants;
    const double fraction = 0.5 + ((i + 0.5) / n - 0.5) * std::sqrt(n * n / (n * n - 1));
    return to_seconds(row.reset.ns) + fraction * to_seconds(row.exposure_ns());
}

} // namespace obscura::renderer
