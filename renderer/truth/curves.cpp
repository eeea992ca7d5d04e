// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/curves.hpp"

#include "renderer/shapes/single_ray.hpp"
#include "renderer/truth/sight.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

/// Steps inwards in which the outermost surface is looked for, then divisions of the step where it is found,
/// each by the rays of a packet: to 1e-12 of the radius.
constexpr int steps_inwards = 256;
constexpr int divisions = 8;

Vec3 product(Vec3 a, Vec3 b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

Vec3 inverse(Vec3 a) {
    return {1 / a.x, 1 / a.y, 1 / a.z};
}

/// The outermost surface seen from `camera_m`, body frame, in the half plane of the azimuth `a`.
std::optional<Vec3> outermost(const Shape& shape, const DetailView* detail, Vec3 camera_m, double a) {
    const double distance = length(camera_m), radius = shape.bounding_radius_m();
    if (!(distance > radius)) return std::nullopt;
    const Vec3 axis = camera_m / -distance;
    Vec3 u, v;
    orthonormal_basis(axis, u, v);
    const Vec3 side = std::cos(a) * u + std::sin(a) * v;
    const double rim = radius / std::sqrt(1 - radius / distance * (radius / distance));
    const auto towards = [&](double r) { return normalized(distance * axis + r * side); };
    double outer = rim, inner = 0;
    // Moves `outer` and `inner` to the first two of 16 equal steps inwards between which the surface begins;
    // without any, `outer` to the last.
    const auto narrow = [&](double step) {
        std::array<Vec3, packet_size> rays{};
        std::array<double, packet_size> ranges{};
        const auto radius_of = [&](std::size_t i) { return outer - step * (static_cast<double>(i) + 1); };
        for (std::size_t i = 0; i < rays.size(); ++i)
            rays[i] = towards(radius_of(i));
        distances_along(shape, camera_m, rays, ranges, detail);
        const auto hit = std::find_if(ranges.begin(), ranges.end(), [](double r) { return r != no_hit; });
        const auto index = static_cast<std::size_t>(hit - ranges.begin());
        if (hit != ranges.end()) inner = radius_of(index);
        if (index > 0) outer = radius_of(index - 1);
        return hit != ranges.end();
    };
    bool found = false;
    for (int i = 0; i < steps_inwards / packet_size && !found; ++i)
        found = narrow(rim / steps_inwards);
    if (!found) return std::nullopt;
    for (int i = 0; i < divisions; ++i)
        narrow((outer - inner) / (packet_size + 1));
    return camera_m + distance_along(shape, camera_m, towards(inner), detail) * towards(inner);
}

} // namespace

BodyCurve::BodyCurve(const TruthScene& scene, std::size_t body, TruthKind kind, std::uint32_t points,
                     const TruthState& middle, std::pmr::memory_resource& memory)
    : scene_(scene),
      body_(body),
      kind_(kind),
      points_(points),
      radii_m_(scene.bodies[body].shape->ellipsoid_radii_m()),
      found_(&memory) {
    if (radii_m_.x > 0) return;
    found_.resize(points);
    const DetailView view = detail_of(scene, middle, body);
    const DetailView* const detail = view.cell_rad > 0 ? &view : nullptr;
    for (std::uint32_t i = 0; i < points; ++i)
        found_[i] =
            outermost(*scene.bodies[body].shape, detail, viewer_m(middle), 2 * std::numbers::pi * i / points);
}

Vec3 BodyCurve::viewer_m(const TruthState& state) const {
    return to_local(state.bodies[body_], kind_ == TruthKind::limb ? state.camera.position_m : state.sun_m);
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
    if (!(radii_m_.x > 0))
        return faces_camera(scene_, state, body_, point_m(state, i), surface_slack_m(scene_, body_));
    const Vec3 scale = inverse(radii_m_);
    const Vec3 camera = product(to_local(state.bodies[body_], state.camera.position_m), scale);
    return dot(product(point_m(state, i), scale), camera) > 1;
}

bool BodyCurve::lit(const TruthState& state, std::uint32_t i) const {
    if (!(radii_m_.x > 0))
        return is_lit(scene_, state, body_, point_m(state, i), surface_slack_m(scene_, body_));
    const Vec3 scale = inverse(radii_m_);
    const Vec3 sun = product(to_local(state.bodies[body_], state.sun_m), scale);
    return dot(product(point_m(state, i), scale), sun) > 1;
}

} // namespace obscura::renderer
