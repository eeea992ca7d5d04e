// SPDX-License-Identifier: Apache-2.0
#include "terrain/detail/face_region.hpp"

#include "terrain/cube_sphere.hpp"

#include <algorithm>
#include <numbers>

namespace obscura::terrain {
namespace {

constexpr double slack = 1e-9;

/// Range of a / w over the unit vectors within the angle of a direction, of which a and w are two components;
/// from -1 to 1.
struct Ratios {
    double low = -1, high = 1;
};
std::optional<Ratios> ratios(double a, double w, double angle_sine) {
    const double across = std::hypot(a, w);
    if (across <= angle_sine + slack) return Ratios{};
    const double middle = std::atan2(a, w), half = std::asin((angle_sine + slack) / across) + slack;
    constexpr double edge = std::numbers::pi / 4;
    if (middle - half > edge || middle + half < -edge) return std::nullopt;
    return Ratios{std::tan(std::max(middle - half, -edge)), std::tan(std::min(middle + half, edge))};
}

} // namespace

std::optional<FaceRegion> region_of_cap(const SurfaceDomain& domain, std::uint8_t face, const Cap& cap) {
    if (domain.is_plane()) {
        const double scale = 1 / domain.half_edge_m(), reach = cap.radius_m * scale + slack;
        const double u = cap.centre_m.x * scale, v = cap.centre_m.y * scale;
        if (std::abs(u) - reach > 1 || std::abs(v) - reach > 1) return std::nullopt;
        return FaceRegion{std::clamp(u - reach, -1.0, 1.0), std::clamp(u + reach, -1.0, 1.0),
                          std::clamp(v - reach, -1.0, 1.0), std::clamp(v + reach, -1.0, 1.0)};
    }
    // Scaled by the radii to the unit sphere, where the cap is within a cap of this chord.
    const Vec3 radii = domain.radii_m();
    const Vec3 c{cap.centre_m.x / radii.x, cap.centre_m.y / radii.y, cap.centre_m.z / radii.z};
    const double chord = cap.radius_m / std::min({radii.x, radii.y, radii.z});
    if (chord > 1) return FaceRegion{};
    const double sine = chord * std::sqrt(1 - chord * chord / 4);
    const CubeFace& side = cube_faces[face];
    const double size = length(c), w = side.sign * component(c, side.axis) / size;
    const auto u = ratios(component(c, side.u_axis) / size, w, sine);
    const auto v = ratios(component(c, side.v_axis) / size, w, sine);
    if (!u || !v) return std::nullopt;
    return FaceRegion{u->low, u->high, v->low, v->high};
}

} // namespace obscura::terrain
