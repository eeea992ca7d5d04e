// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/lamp_change.hpp"

#include "core/geometry.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::renderer {
namespace {

/// Pose of a lamp from the centre of a body.
Pose seen_from(const Pose& body, const Pose& lamp) {
    return {lamp.position_m - body.position_m, lamp.orientation};
}

/// Between the axes of two lamps.
double axis_angle_rad(const Pose& a, const Pose& b) {
    const Vec3 u = rotate(a.orientation, {0, 0, 1});
    const Vec3 v = rotate(b.orientation, {0, 0, 1});
    return std::atan2(length(cross(u, v)), dot(u, v));
}

/// Way of a lamp's light over a body, metres.
double way_m(const Pose& from, const Pose& to, bool has_axis, double radius_m) {
    const double way = length(to.position_m - from.position_m);
    const double nearest = std::min(length(from.position_m), length(to.position_m)) - radius_m;
    if (way > 0 && !(nearest > 0)) return std::numeric_limits<double>::infinity();
    const double shadows = way > 0 ? way * 2 * radius_m / nearest : 0;
    const double farthest = std::max(length(from.position_m), length(to.position_m)) + radius_m;
    return way + shadows + (has_axis ? axis_angle_rad(from, to) * farthest : 0);
}

} // namespace

double lamp_change_px(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                      const Projection& projection, const GroundTruth& from, std::span<const Pose> from_lamps,
                      const GroundTruth& to, std::span<const Pose> to_lamps) {
    if (scene.bodies.size() > max_truth_bodies) return std::numeric_limits<double>::infinity();
    double max_rad = 0;
    for (std::size_t b = 0; b < scene.bodies.size(); ++b) { // `bodies` may have the Sun after these
        const Pose &before = from.bodies[b].pose, &after = to.bodies[b].pose;
        const double radius_m = bodies[b].shape->bounding_radius_m();
        const double range_m = std::min(length(before.position_m - from.camera.position_m),
                                        length(after.position_m - to.camera.position_m)) -
                               radius_m;
        for (std::size_t l = 0; l < from_lamps.size(); ++l) {
            const double way = way_m(seen_from(before, from_lamps[l]), seen_from(after, to_lamps[l]),
                                     scene.lamps[l].beam != scene::Lamp::Beam::point, radius_m);
            if (way > 0 && !(range_m > 0)) return std::numeric_limits<double>::infinity();
            if (way > 0) max_rad = std::max(max_rad, way / range_m);
        }
    }
    return max_rad / (projection.pixel_angle_rad() * scene.camera.pixel_flattening());
}

} // namespace obscura::renderer
