// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/row_state.hpp"

#include "core/solar_spectrum.hpp"
#include "ephemeris/kernels/apparent_place.hpp"
#include "renderer/camera/aberration.hpp"
#include "renderer/planets/surface_tiles.hpp"
#include "renderer/world/kinematics.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

Mat3 product(const Mat3& a, const Mat3& b) {
    Mat3 c;
    for (int r = 0; r < 3; ++r)
        for (int k = 0; k < 3; ++k)
            c.m[r][k] = a.m[r][0] * b.m[0][k] + a.m[r][1] * b.m[1][k] + a.m[r][2] * b.m[2][k];
    return c;
}

bool same_pose(const BodyState& a, const BodyState& b) {
    bool same = a.seen.pose.position_m == b.seen.pose.position_m && a.seen.beta == b.seen.beta;
    for (int r = 0; r < 3; ++r)
        for (int k = 0; k < 3; ++k)
            same = same && a.to_inertial.m[r][k] == b.to_inertial.m[r][k];
    return same;
}

/// Whether `b` can reach into the convex hull of the bounding sphere of `a` and the Sun.
bool may_shade(const BodyState& a, const BodyState& b, Vec3 sun_m, double sun_radius_m) {
    const Vec3 axis = sun_m - a.seen.pose.position_m;
    const double axis_length = length(axis);
    const double ra = a.shape->bounding_radius_m();
    // Where it is when the light leaves `a`; it moves on while light travels between the two.
    const Vec3 offset = b.seen.position_at(a.seen.range_m) - a.seen.pose.position_m;
    const double moved =
        tilts(a, b) ? (length(a.seen.beta) + length(b.seen.beta)) * 2 * (length(offset) + ra) : 0;
    const double rb = b.shape->bounding_radius_m() + moved;
    if (length(offset) <= ra + rb) return true;
    const double along = std::clamp(dot(offset, axis) / (axis_length * axis_length), 0.0, 1.0);
    const double slope = std::abs(sun_radius_m - ra) / axis_length;
    const double hull = (ra + (sun_radius_m - ra) * along) * std::sqrt(1 + slope * slope) + slope * rb;
    return length(offset - along * axis) <= hull + rb * std::sqrt(1 + slope * slope);
}

void set_occluders(double sun_radius_m, RowState& row) {
    for (std::size_t a = 0; a < row.bodies.size(); ++a) {
        if (row.bodies[a].material == nullptr) continue;
        for (std::size_t b = 0; b < row.bodies.size(); ++b)
            if (b != a && row.bodies[b].material != nullptr &&
                may_shade(row.bodies[a], row.bodies[b], row.sun_m, sun_radius_m))
                row.bodies[a].occluders.push_back(static_cast<std::int32_t>(b));
    }
}

/// See BodyState::reference_radiance.
double reference_radiance(const BodyState& s) {
    if (s.material == nullptr) return 0;
    const double sun_distance = length(s.sun_m);
    const double camera_distance = length(s.camera_m);
    if (!(sun_distance > 0 && camera_distance > 0)) return 0;
    const double cos_phase =
        std::clamp(dot(s.sun_m, s.camera_m) / (sun_distance * camera_distance), -1.0, 1.0);
    const double cos_half = std::max(0.1, std::sqrt((1 + cos_phase) / 2));
    ScatterPacket scatter;
    for (int i = 0; i < packet_size; ++i) {
        scatter.cos_in[i] = scatter.cos_out[i] = cos_half;
        scatter.cos_phase[i] = cos_phase;
    }
    Doubles r;
    s.material->reflectance(scatter, r);
    const double factor = s.built->textures ? s.built->textures->mean_factor() : 1;
    return r[0] * factor * astronomical_unit_m * astronomical_unit_m / (sun_distance * sun_distance);
}

/// Pose at the instant `seen_s` at which the light left it that is at `camera_m` at `time_s`; with
/// Scene::light_time else at `time_s`.
template<typename PoseAt>
Pose pose_at_emission(const scene::Scene& scene, Vec3 camera_m, double time_s, const PoseAt& pose_at,
                      double& seen_s) {
    Pose pose = pose_at(time_s);
    seen_s = time_s;
    if (!scene.light_time) return pose;
    // Fixed-point iteration: each step reduces the error by the factor v / c; stop when it settles.
    for (int step = 0; step < 20; ++step) {
        const double next_s = time_s - length(pose.position_m - camera_m) / light_speed_m_s;
        const bool settled = std::abs(next_s - seen_s) < 1e-12;
        seen_s = next_s;
        pose = pose_at(seen_s);
        if (settled) break;
    }
    return pose;
}

Pose seen_pose_at(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t i, Vec3 camera_m,
                  double time_s, double& seen_s) {
    return pose_at_emission(
        scene, camera_m, time_s, [&](double t) { return body_pose(scene, bodies, i, t); }, seen_s);
}

/// What the states of the bodies of a row have in common.
struct RowView {
    const scene::Scene& scene;
    const Projection& projection;
    std::uint32_t samples_per_pixel;
    double margin_rad; ///< RowState::reach_rad
};

/// Sets place, orientation and axes of body `i`, whose place is seen, and where camera and Sun stand in them.
void set_frames(const RowView& view, std::size_t i, RowState& row) {
    BodyState& s = row.bodies[i];
    s.to_inertial = to_matrix(s.seen.pose.orientation);
    const Mat3 from_inertial = transposed(s.to_inertial);
    s.from_inertial = from_inertial;
    // Bodies at rest relative to each other are mostly neighbours in the list.
    s.frame =
        i > 0 && same_pose(s, row.bodies[i - 1]) ? row.bodies[i - 1].frame : static_cast<std::int32_t>(i);
    s.from_camera = product(from_inertial, row.inertial_from_camera);
    s.beta = from_inertial * s.seen.beta;
    s.camera_m = from_inertial * (row.camera.position_m - s.seen.position_at(0));
    // Some units in the last place of the coordinates that are subtracted.
    s.camera_error_m = 0x1p-50 * (length(row.camera.position_m) + length(s.seen.position_at(0)));
    s.sun_m = from_inertial * s.seen.to_sun_m(row.sun_m);
    s.detail = {};
    if (s.shape->tiles() != nullptr) {
        s.detail.eye_m = s.camera_m;
        s.detail.cell_rad = s.shape->tiles()->cell_px() * view.projection.pixel_angle_rad();
    }
}

/// Sets the extent of a body in whose bounding sphere the camera is.
void set_all_around(const RowView& view, BodyState& s) {
    s.radius_px = 0;
    s.disc = {};
    s.direction = {0, 0, 1};
    s.cone_sine = 1;
    s.cos_cone = -1;
    s.reach_chord2 = 5;
    s.solid_angle_sr = 4 * std::numbers::pi;
    s.targeted = false;
    s.large = true;
    s.small = false;
    s.samples = view.samples_per_pixel;
}

/// Sets lit part, classes of size and number of samples of a body of `radius_px` pixels.
void set_sampling(const RowView& view, double radius_px, BodyState& s) {
    const scene::Scene& scene = view.scene;
    s.radius_px = radius_px;
    // The Sun has no dark side.
    s.disc = LitDisc(*s.shape, s.camera_m, s.sun_m, s.material != nullptr ? scene.sun.radius_m : 0);
    s.targeted = radius_px < targeted_radius_px;
    const double lit_share = s.disc.lit_share();
    const double share = s.disc.exact() ? crescent_share : rough_crescent_share;
    const bool thin = !s.targeted && lit_share < share &&
                      lit_share * std::numbers::pi * radius_px * radius_px < crescent_area_px;
    s.thin_crescent = thin && s.disc.exact();
    if (const FacetSet* facets = thin && !s.disc.exact() ? s.shape->facets() : nullptr) {
        s.lit_facets = facets->lit(s.camera_m, s.sun_m, scene.sun.radius_m);
        s.thin_crescent = true;
    }
    s.large = radius_px > large_radius_px;
    s.small = !s.targeted && radius_px <= small_radius_px;
    s.samples = 0;
    if (!s.targeted) {
        const double pixels = std::numbers::pi * radius_px * radius_px * scene.camera.pixel_flattening();
        const double wanted = samples_per_body / pixels;
        s.samples = std::max(view.samples_per_pixel, static_cast<std::uint32_t>(std::ceil(wanted)));
    }
}

/// Sets where in the picture a body is and how large, after set_frames().
void set_extent(const RowView& view, const RowState& row, BodyState& s) {
    const Vec3 to_body = s.seen.pose.position_m - row.camera.position_m;
    const double distance = s.seen.moves() ? length(s.camera_m) : length(to_body);
    // The frame of a moving body turns directions towards its motion, by different angles about a cone.
    const double widened = s.seen.moves() ? 1 + 2 * length(s.beta) : 1;
    const double radius = s.shape->bounding_radius_m();
    s.thin_crescent = false;
    s.lit_facets = nullptr;
    const double half_angle = distance > radius ? std::asin(radius / distance) * widened : 10;
    if (s.seen.moves() ? !(half_angle < std::numbers::pi / 2) : distance <= radius) {
        set_all_around(view, s);
        return;
    }
    s.direction = row.camera_from_inertial * (to_body / length(to_body));
    s.cone_sine = s.seen.moves() ? std::sin(half_angle) : radius / distance;
    s.cos_cone = std::sqrt(std::max(0.0, 1 - s.cone_sine * s.cone_sine));
    s.solid_angle_sr =
        2 * std::numbers::pi * (s.cone_sine * s.cone_sine / (1 + s.cos_cone)); // 2 pi (1 - cos)
    const double half = (half_angle + view.margin_rad) / 2;
    s.reach_chord2 = half < std::numbers::pi / 2 ? 4 * std::sin(half) * std::sin(half) : 5;
    set_sampling(view, half_angle / view.projection.local_pixel_angle_rad(s.direction), s);
}

} // namespace

Mat3 relative_rotation(const BodyState& from, const BodyState& to) {
    return product(transposed(to.to_inertial), from.to_inertial);
}

Vec3 relative_origin(const BodyState& from, const BodyState& to, double path_m) {
    return to.from_inertial * (from.seen.position_at(path_m) - to.seen.position_at(path_m));
}

Vec3 relative_direction(const BodyState& from, const BodyState& to, Vec3 direction, double& stretch) {
    // w = s (m + beta_from), s being the distance along the inertial direction m.
    const Vec3 w = from.to_inertial * direction;
    const double s = length(untilted(w, from.seen.beta));
    const Vec3 there = w / s + (to.seen.beta - from.seen.beta);
    const double norm = length(there);
    stretch = norm * s;
    return to.from_inertial * (there / norm);
}

Pose seen_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t i, Vec3 camera_m,
               double time_s) {
    double seen_s = 0;
    return seen_pose_at(scene, bodies, i, camera_m, time_s, seen_s);
}

ApparentBody apparent_body(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t i,
                           Vec3 camera_m, double time_s) {
    double seen_s = 0;
    const Pose pose = seen_pose_at(scene, bodies, i, camera_m, time_s, seen_s);
    ApparentBody body{deflected(scene, pose, camera_m, time_s)};
    body.range_m = length(body.pose.position_m - camera_m);
    if (scene.light_time) body.beta = body_velocity_m_s(scene, bodies, i, seen_s) / light_speed_m_s;
    return body;
}

ApparentBody apparent_lamp(const scene::Scene& scene, std::span<const BuiltBody> bodies,
                           const scene::Lamp& lamp, Vec3 camera_m, double time_s) {
    double seen_s = 0;
    ApparentBody at{pose_at_emission(
        scene, camera_m, time_s, [&](double t) { return lamp_pose(scene, bodies, lamp, t); }, seen_s)};
    at.range_m = length(at.pose.position_m - camera_m);
    if (scene.light_time) at.beta = lamp_velocity_m_s(scene, bodies, lamp, seen_s) / light_speed_m_s;
    return at;
}

Pose deflected(const scene::Scene& scene, Pose seen, Vec3 camera_m, double time_s) {
    if (!scene.light_deflection) return seen;
    const Vec3 sun_m = scene.sun.position_at(time_s);
    if (length(seen.position_m - sun_m) < scene.sun.radius_m) return seen; // the Sun itself
    seen.position_m = camera_m + ephemeris::deflected_by_sun(seen.position_m - camera_m, sun_m - camera_m);
    return seen;
}

Pose apparent_pose(const scene::Scene& scene, std::span<const BuiltBody> bodies, std::size_t i, Vec3 camera_m,
                   double time_s) {
    return deflected(scene, seen_pose(scene, bodies, i, camera_m, time_s), camera_m, time_s);
}

Vec3 camera_beta(const scene::Scene& scene, const std::vector<BuiltBody>& bodies, double time_s) {
    if (!scene.aberration) return {0, 0, 0};
    return transposed(to_matrix(camera_pose(scene, bodies, time_s).orientation)) *
           (camera_velocity_m_s(scene, bodies, time_s) / light_speed_m_s);
}

void set_row_state(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                   const Projection& projection, double sample_reach_px, std::uint32_t samples_per_pixel,
                   double time_s, RowState& row) {
    row.time_s = time_s;
    row.duration_s = 0;
    row.camera = camera_pose(scene, bodies, time_s);
    row.inertial_from_camera = to_matrix(row.camera.orientation);
    row.camera_from_inertial = transposed(row.inertial_from_camera);
    row.sun_m = scene.sun.position_at(time_s);
    row.bodies.resize(bodies.size());
    // Largest distance of a displaced sample from its pixel's centre.
    row.reach_rad = (sample_reach_px + 1e-6) * std::numbers::sqrt2 * projection.pixel_angle_rad();

    const RowView view{scene, projection, samples_per_pixel, row.reach_rad};
    for (std::size_t i = 0; i < bodies.size(); ++i) {
        BodyState& s = row.bodies[i];
        s.seen = apparent_body(scene, bodies, i, row.camera.position_m, time_s);
        s.shape = bodies[i].shape.get();
        s.material = bodies[i].material.get();
        s.built = &bodies[i];
        set_frames(view, i, row);
        s.occluders.clear();
        s.reference_radiance = reference_radiance(s);
        set_extent(view, row, s);
    }
    row.lamps.clear();
    for (const scene::Lamp& lamp : scene.lamps)
        row.lamps.push_back(apparent_lamp(scene, bodies, lamp, row.camera.position_m, time_s));
    set_occluders(scene.sun.radius_m, row);
}

} // namespace obscura::renderer
