// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/disc_shares.hpp"

#include "renderer/shapes/single_ray.hpp"
#include "renderer/truth/sight.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Rays over the disc of a body, for the part of it that is seen.
constexpr int disc_rays = 128;

} // namespace

DiscShares disc_shares(const TruthScene& scene, const RowStates& states, std::size_t body, std::size_t window,
                       const TruthState& state) {
    const Shape& shape = *scene.bodies[body].shape;
    const ApparentBody& apparent = state.bodies[body];
    const Vec3 to_body = apparent.pose.position_m - state.camera.position_m;
    const double distance = length(to_body), radius = shape.bounding_radius_m();
    if (!(distance > radius)) return {1, 1};
    const Vec3 eye = state.eye_m(body);
    const Vec3 axis = to_body / distance;
    Vec3 u, v;
    orthonormal_basis(axis, u, v);
    // In the plane through the centre, across the line of sight, the cone has this radius.
    const double rim = radius / std::sqrt(1 - radius / distance * (radius / distance));
    int disc = 0, inside = 0, seen = 0;
    for (int i = 0; i < disc_rays; ++i) {
        const double r = rim * std::sqrt((i + 0.5) / disc_rays);
        const double a = i * std::numbers::pi * (3 - std::sqrt(5.0));
        const Vec3 ray = normalized(to_body + r * std::cos(a) * u + r * std::sin(a) * v);
        const double range = distance_along(shape, eye, apparent.direction(ray)) / apparent.stretch(ray);
        if (range == no_hit) continue;
        ++disc;
        const Vec3 direction = state.camera_from_inertial * ray;
        ImagePoint shift;
        const auto at = states.project(state, direction, shift);
        if (!at || !states.on_window(window, *at)) continue;
        ++inside;
        if (!is_hidden(scene, state, direction, range, body)) ++seen;
    }
    if (disc == 0) return {};
    return {static_cast<double>(seen) / disc, static_cast<double>(inside) / disc};
}

} // namespace obscura::renderer
