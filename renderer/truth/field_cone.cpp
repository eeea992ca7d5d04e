// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/field_cone.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

double cone_angle(Vec3 a, Vec3 b) {
    return std::atan2(length(cross(a, b)), dot(a, b));
}

} // namespace

FieldCone::FieldCone(const TruthScene& scene, RowStates& states, std::size_t body) {
    const std::uint32_t middle = states.instants() / 2;
    std::int32_t last = 0;
    for (const FrameWindow& window : states.windows())
        last = std::max(last, window.image_y + window.sensor.height - 1);
    rows_ = {&states.at(0, middle), &states.at(last / 2, middle), &states.at(last, middle)};
    const auto eye_of = [&](const TruthState& s) { return s.eye_m(body); };
    const auto boresight_of = [&](const TruthState& s) {
        return s.bodies[body].direction(transposed(s.camera_from_inertial) * Vec3{0, 0, 1});
    };
    eye_m_ = eye_of(*rows_[1]);
    boresight_ = boresight_of(*rows_[1]);
    field_rad_ = scene.field_rad;
    for (const TruthState* const row : rows_) {
        moved_m_ = std::max(moved_m_, length(eye_of(*row) - eye_m_));
        field_rad_ = std::max(field_rad_, scene.field_rad + cone_angle(boresight_of(*row), boresight_) +
                                              2 * (length(row->beta) + length(row->bodies[body].beta)));
    }
}

bool FieldCone::may_show(Vec3 centre_m, double radius_m) const {
    const Vec3 to_ball = centre_m - eye_m_;
    const double distance_m = length(to_ball), slack_m = radius_m + moved_m_;
    return distance_m <= slack_m ||
           cone_angle(to_ball, boresight_) <= field_rad_ + std::asin(slack_m / distance_m);
}

bool may_rise(Vec3 radii_m, Vec3 eye_m, Vec3 place_m, double radius_m, HeightBounds heights) {
    const auto scaled = [&](Vec3 p) { return Vec3{p.x / radii_m.x, p.y / radii_m.y, p.z / radii_m.z}; };
    const Vec3 eye = scaled(eye_m), place = scaled(place_m);
    const double low = 1 + heights.least, high = 1 + heights.highest_here;
    const double horizon = std::acos(std::min(1.0, low / length(eye))) + std::acos(std::min(1.0, low / high));
    const double min_radius = std::min({radii_m.x, radii_m.y, radii_m.z});
    return cone_angle(eye, place) < horizon + 1.1 * radius_m / min_radius;
}

} // namespace obscura::renderer
