// SPDX-License-Identifier: Apache-2.0
#include "renderer/truth/curves.hpp"

#include "renderer/planets/surface_tiles.hpp"
#include "renderer/shapes/single_ray.hpp"
#include "renderer/truth/field_cone.hpp"
#include "renderer/truth/sight.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

namespace obscura::renderer {
namespace {

/// Steps inwards in which the outermost surface is looked for, then divisions of the step where it is
/// found, each by the rays of a packet: to 1e-12 of the radius.
constexpr int steps_inwards = 256;
constexpr int curve_divisions = 8;

Vec3 matrix_product(Vec3 a, Vec3 b) {
    return {a.x * b.x, a.y * b.y, a.z * b.z};
}

Vec3 inverse(Vec3 a) {
    return {1 / a.x, 1 / a.y, 1 / a.z};
}

/// Distance from the origin, in the plane across the line of sight, of a tangent of a sphere about it.
double rim_of(double radius, double distance) {
    return radius / std::sqrt(1 - radius / distance * (radius / distance));
}

/// Directions from a viewer, in half planes about the direction to the body's origin.
class Outlook {
public:
    explicit Outlook(Vec3 viewer_m) : distance_(length(viewer_m)), axis_(viewer_m / -distance_) {
        orthonormal_basis(axis_, u_, v_);
    }
    [[nodiscard]] double distance() const { return distance_; }
    /// Azimuth, and distance from the origin in the plane across the line of sight.
    [[nodiscard]] Vec3 towards(double a, double r) const {
        return normalized(distance_ * axis_ + r * side(a));
    }
    /// The point nearest to the origin of a ray that is a tangent of a sphere.
    [[nodiscard]] Vec3 tangent_point(double a, double radius) const {
        const double sine = radius / distance_;
        return radius * (std::sqrt(1 - sine * sine) * side(a) - sine * axis_);
    }

private:
    [[nodiscard]] Vec3 side(double a) const { return std::cos(a) * u_ + std::sin(a) * v_; }

    double distance_;
    Vec3 axis_, u_, v_;
};

/// Point of the limb of an ellipsoid seen from `camera_m` outside of it. Scaled to the unit sphere, the
/// tangent points p of the viewer c are the circle p c = 1.
Vec3 ellipsoid_limb(Vec3 radii_m, Vec3 camera_m, double azimuth_rad) {
    const Vec3 c = matrix_product(camera_m, inverse(radii_m));
    const double distance2 = length_squared(c);
    Vec3 u, v;
    orthonormal_basis(c / std::sqrt(distance2), u, v);
    const double radius = std::sqrt(std::max(0.0, 1 - 1 / distance2));
    return matrix_product(c / distance2 + radius * (std::cos(azimuth_rad) * u + std::sin(azimuth_rad) * v),
                          radii_m);
}

/// The outermost surface seen from `camera_m`, body frame, in the half plane of the azimuth `a`.
std::optional<Vec3> outermost(const Shape& shape, const DetailView* detail, Vec3 camera_m, double a) {
    const Outlook outlook(camera_m);
    const double radius = shape.bounding_radius_m();
    if (!(outlook.distance() > radius)) return std::nullopt;
    const double rim = rim_of(radius, outlook.distance());
    const auto towards = [&](double r) { return outlook.towards(a, r); };
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
    for (int i = 0; i < curve_divisions; ++i)
        narrow((outer - inner) / (packet_size + 1));
    return camera_m + distance_along(shape, camera_m, towards(inner), detail) * towards(inner);
}

} // namespace

BodyCurve::BodyCurve(const TruthScene& scene, std::size_t body, TruthKind kind, const CurveSpan& span,
                     RowStates& states)
    : scene_(scene),
      body_(body),
      kind_(kind),
      span_(span),
      radii_m_(scene.bodies[body].shape->ellipsoid_radii_m()),
      found_(&states.memory()) {
    if (radii_m_.x > 0) return;
    found_.resize(span.points);
    const SurfaceTiles* const tiles = scene.bodies[body].shape->tiles();
    if (tiles != nullptr && !tiles->domain().is_plane()) {
        find_on_heights(*tiles, states);
        return;
    }
    const TruthState& middle = states.middle_of(0);
    const DetailView view = detail_of(scene, middle, body);
    const DetailView* const detail = view.cell_rad > 0 ? &view : nullptr;
    for (std::uint32_t i = 0; i < span.points; ++i)
        found_[i] = outermost(*scene.bodies[body].shape, detail, viewer_m(middle), span.azimuth_rad(i));
}

void BodyCurve::find_on_heights(const SurfaceTiles& tiles, RowStates& states) {
    const Shape& shape = *scene_.bodies[body_].shape;
    const TruthState& middle = states.middle_of(0);
    const Outlook outlook(viewer_m(middle));
    const Vec3 radii = tiles.domain().radii_m();
    const double largest = shape.bounding_radius_m();
    const double least = std::min({radii.x, radii.y, radii.z}) * (1 + tiles.least()) * (1 - 1e-9);
    if (!(outlook.distance() > largest)) return;
    const DetailView detail = detail_of(scene_, middle, body_);
    const FieldCone cone(scene_, states, body_);
    const double half_chord = std::sqrt(largest * largest - least * least);
    const auto in_view = [&](double a) {
        // About the tangents of the two spheres between which the surface is.
        const Vec3 low = outlook.tangent_point(a, least), high = outlook.tangent_point(a, largest);
        const Vec3 centre = (low + high) / 2;
        const double radius = length(high - low) / 2 + half_chord;
        return cone.may_show(centre, radius) && may_rise(radii, cone.eye_m(), centre, radius + cone.moved_m(),
                                                         {tiles.least(), tiles.largest()});
    };
    // A ray nearer to the centre than one that meets the surface crosses what is below that point and meets
    // it too: halve, for the azimuths of a packet together.
    constexpr double close_enough = 1e-9;
    struct Search {
        std::uint32_t point = 0;
        double azimuth = 0, inner = 0, outer = 0;
    };
    std::array<Search, packet_size> searches;
    std::size_t count = 0;
    const auto trace = [&](const auto& radius_of, std::span<double> ranges, std::span<Vec3> rays) {
        for (std::size_t i = 0; i < count; ++i)
            rays[i] = outlook.towards(searches[i].azimuth, radius_of(searches[i]));
        distances_along(shape, viewer_m(middle), rays.first(count), ranges.first(count), &detail);
    };
    const auto finish = [&] {
        std::array<Vec3, packet_size> rays{};
        std::array<double, packet_size> ranges{};
        while (count > 0 && searches[0].outer - searches[0].inner > close_enough * largest) {
            const auto half = [](const Search& s) { return (s.inner + s.outer) / 2; };
            trace(half, ranges, rays);
            for (std::size_t i = 0; i < count; ++i)
                (ranges[i] != no_hit ? searches[i].inner : searches[i].outer) = half(searches[i]);
        }
        trace([](const Search& s) { return s.inner; }, ranges, rays);
        for (std::size_t i = 0; i < count; ++i)
            if (ranges[i] != no_hit) found_[searches[i].point] = viewer_m(middle) + ranges[i] * rays[i];
        count = 0;
    };
    for (std::uint32_t i = 0; i < span_.points; ++i) {
        const double azimuth = span_.azimuth_rad(i);
        if (!in_view(azimuth)) continue;
        searches[count++] = {i, azimuth, rim_of(least, outlook.distance()),
                             rim_of(largest, outlook.distance())};
        if (count == searches.size()) finish();
    }
    finish();
}

Vec3 BodyCurve::viewer_m(const TruthState& state) const {
    return kind_ == TruthKind::limb ? state.eye_m(body_) : state.sun_from_m(body_);
}

bool BodyCurve::has(const TruthState& state, std::uint32_t i) const {
    if (kind_ == TruthKind::terminator && !(scene_.scene.sun.irradiance_scale > 0)) return false;
    if (!(radii_m_.x > 0)) return found_[i].has_value();
    return length_squared(matrix_product(viewer_m(state), inverse(radii_m_))) > 1;
}

Vec3 BodyCurve::point_m(const TruthState& state, std::uint32_t i) const {
    if (!(radii_m_.x > 0)) return *found_[i];
    return ellipsoid_limb(radii_m_, viewer_m(state), span_.azimuth_rad(i));
}

std::optional<Vec3> BodyCurve::about_m(const TruthScene& scene, std::size_t body, const TruthState& state,
                                       double azimuth_rad) {
    const Shape& shape = *scene.bodies[body].shape;
    const Vec3 radii = shape.ellipsoid_radii_m();
    const Vec3 viewer = state.eye_m(body);
    if (radii.x > 0) {
        if (!(length_squared(matrix_product(viewer, inverse(radii))) > 1)) return std::nullopt;
        return ellipsoid_limb(radii, viewer, azimuth_rad);
    }
    const SurfaceTiles* const tiles = shape.tiles();
    if (tiles == nullptr || tiles->domain().is_plane()) return std::nullopt;
    const Vec3 domain = tiles->domain().radii_m();
    const double least = std::min({domain.x, domain.y, domain.z}) * (1 + tiles->least());
    const double radius = (least + shape.bounding_radius_m()) / 2;
    if (!(length(viewer) > radius)) return std::nullopt;
    return Outlook(viewer).tangent_point(azimuth_rad, radius);
}

bool BodyCurve::near_side(const TruthState& state, std::uint32_t i) const {
    if (kind_ == TruthKind::limb) return true;
    if (!(radii_m_.x > 0))
        return faces_camera(scene_, state, body_, point_m(state, i), surface_slack_m(scene_, body_));
    const Vec3 scale = inverse(radii_m_);
    const Vec3 camera = matrix_product(state.eye_m(body_), scale);
    return dot(matrix_product(point_m(state, i), scale), camera) > 1;
}

bool BodyCurve::lit(const TruthState& state, std::uint32_t i) const {
    if (!(radii_m_.x > 0))
        return is_lit(scene_, state, body_, point_m(state, i), surface_slack_m(scene_, body_));
    const Vec3 scale = inverse(radii_m_);
    const Vec3 sun = matrix_product(state.sun_from_m(body_), scale);
    return dot(matrix_product(point_m(state, i), scale), sun) > 1;
}

} // namespace obscura::renderer
