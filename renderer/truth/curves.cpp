// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/curves.hpp"

#include "renderer/shapes/single_ray.hpp"
#include "renderer/truth/sight.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Steps inwards in which the outermost surface is looked for, then halvings of the step.
constexpr int steps_inwards = 256;
constexpr int halvings = 40;

Vec3 product(Vec3 a, Vec3 b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

Vec3 inverse(Vec3 a) {
    return {1 / a.x, 1 / a.y, 1 / a.z};
}

/// The outermost surface seen from `camera_m`, body frame, in the half plane of the azimuth `a`.
std::optional<Vec3> outermost(const Shape& shape, Vec3 camera_m, double a) {
    const double distance = length(camera_m), radius = shape.bounding_radius_m();
    if (!(distance > radius)) return std::nullopt;
    const Vec3 axis = camera_m / -distance;
    Vec3 u, v;
    orthonormal_basis(axis, u, v);
    const Vec3 side = std::cos(a) * u + std::sin(a) * v;
    const double rim = radius / std::sqrt(1 - radius / distance * (radius / distance));
    const auto range = [&](double r) {
        return distance_along(shape, camera_m, normalized(distance * axis + r * side));
    };
    double outer = rim, inner = 0;
    bool found = false;
    for (int i = 0; i < steps_inwards && !found; ++i) {
        inner = rim * (1 - (i + 1.0) / steps_inwards);
        found = range(inner) != no_hit;
        if (!found) outer = inner;
    }
    if (!found) return std::nullopt;
    for (int i = 0; i < halvings; ++i) {
        const double middle = (outer + inner) / 2;
        (range(middle) != no_hit ? inner : outer) = middle;
    }
    return camera_m + range(inner) * normalized(distance * axis + inner * side);
}

} // namespace

BodyCurve::BodyCurve(const TruthScene& scene, std::size_t body, TruthKind kind, std::uint32_t points,
                     const TruthState& middle)
    : scene_(scene),
      body_(body),
      kind_(kind),
      points_(points),
      radii_m_(scene.bodies[body].shape->ellipsoid_radii_m()) {
    if (radii_m_.x > 0) return;
    found_.resize(points);
    if (kind != TruthKind::limb) return;
    for (std::uint32_t i = 0; i < points; ++i)
        found_[i] = outermost(*scene.bodies[body].shape, viewer_m(middle), 2 * std::numbers::pi * i / points);
}

Vec3 BodyCurve::viewer_m(const TruthState& state) const {
    return to_local(state.bodies[body_],
                    kind_ == TruthKind::limb ? state.camera.position_m : scene_.scene.sun.position_m);
}

bool BodyCurve::has(const TruthState& state, std::uint32_t i) const {
    if (kind_ == TruthKind::terminator && !(scene_.scene.sun.irradiance_scale > 0)) return false;
    if (!(radii_m_.x > 0)) return found_[i].has_value();
    return length_squared(product(viewer_m(state), inverse(radii_m_))) > 1;
}

Vec3 BodyCurve::point_m(const TruthState& state, std::uint32_t i) const {
    if (!(radii_m_.x > 0)) return *found_[i];
    // Scaled to the unit sphere, the tangent points p of the viewer c are the circle p c = 1.
    const Vec3 c = product(viewer_m(state), inverse(radii_m_));
    const double distance2 = length_squared(c);
    Vec3 u, v;
    orthonormal_basis(c / std::sqrt(distance2), u, v);
    const double a = 2 * std::numbers::pi * i / points_;
    const double radius = std::sqrt(std::max(0.0, 1 - 1 / distance2));
    return product(c / distance2 + radius * (std::cos(a) * u + std::sin(a) * v), radii_m_);
}

bool BodyCurve::near_side(const TruthState& state, std::uint32_t i) const {
    if (kind_ == TruthKind::limb) return true;
    const Vec3 scale = inverse(radii_m_);
    const Vec3 camera = product(to_local(state.bodies[body_], state.camera.position_m), scale);
    return dot(product(point_m(state, i), scale), camera) > 1;
}

bool BodyCurve::lit(const TruthState& state, std::uint32_t i) const {
    if (!(radii_m_.x > 0)) {
        // Clear of the surface, towards the camera.
        const Vec3 point = point_m(state, i);
        const double clear_m = 1e-6 * scene_.bodies[body_].shape->bounding_radius_m();
        return is_lit(scene_, state, body_, point + clear_m * normalized(viewer_m(state) - point));
    }
    const Vec3 scale = inverse(radii_m_);
    const Vec3 sun = product(to_local(state.bodies[body_], scene_.scene.sun.position_m), scale);
    return dot(product(point_m(state, i), scale), sun) > 1;
}

} // namespace obscura::renderer
