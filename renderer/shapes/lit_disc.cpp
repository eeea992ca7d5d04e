// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/lit_disc.hpp"

#include "renderer/packets/vector_math.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

Vec3 scaled(Vec3 a, Vec3 factor) {
    return {a.x * factor.x, a.y * factor.y, a.z * factor.z};
}

/// Maps the unit square to the unit disc: Shirley and Chiu, A Low Distortion Map Between Disk and Square,
/// Journal of Graphics Tools 2(3), 1997.
void concentric(double u, double v, double& x, double& y) {
    const double a = 2 * u - 1;
    const double b = 2 * v - 1;
    const bool wide = std::abs(a) > std::abs(b);
    const double r = wide ? a : b;
    const double eighth = r != 0 ? (wide ? b : a) / r / 8 : 0.0;
    double sine;
    double cosine;
    sincos_turn(wide ? eighth : 0.25 - eighth, sine, cosine);
    x = r * cosine;
    y = r * sine;
}

} // namespace

LitDisc::LitDisc(const Shape& shape, Vec3 observer_m, Vec3 sun_m, double sun_radius_m) {
    radii_m_ = shape.ellipsoid_radii_m();
    half_at_least_ = radii_m_.x == 0;
    if (half_at_least_) {
        const double r = shape.bounding_radius_m();
        radii_m_ = {r, r, r};
    }
    const Vec3 inverse{1 / radii_m_.x, 1 / radii_m_.y, 1 / radii_m_.z};
    const Vec3 to_centre = scaled(-observer_m, inverse);
    const double d = length(to_centre);
    if (!(d > 1)) return;
    const double g = std::sqrt((d - 1) * (d + 1));
    limb_tangent_ = 1 / g;
    scale_m3_ = radii_m_.x * radii_m_.y * radii_m_.z / (g * g);
    z_axis_ = to_centre / d;
    orthonormal_basis(z_axis_, x_axis_, y_axis_);
    all_lit_ = sun_radius_m == 0;
    if (all_lit_) return;

    const Vec3 to_sun = scaled(sun_m, inverse);
    const double sun_distance = length(to_sun);
    if (!(sun_distance > 1)) {
        all_lit_ = true;
        return;
    }
    const Vec3 s = to_sun / sun_distance;
    const double sz = dot(s, z_axis_);
    const Vec3 across = s - z_axis_ * sz;
    sun_x_ = length(across);
    if (sun_x_ > 0) {
        x_axis_ = across / sun_x_;
        y_axis_ = cross(z_axis_, x_axis_);
    }
    // The scaled Sun lies within a sphere of this radius.
    const double sun_radius = sun_radius_m * std::max({inverse.x, inverse.y, inverse.z});
    const double c = std::clamp((1 - sun_radius) / sun_distance, -1.0, 1.0);
    limb_ = (sz + c * d) / g;
    slant_ = (c + d * sz) / g;
    square_ = sun_x_ * sun_x_ + slant_ * slant_;
    inverse_square_ = square_ > 0 ? 1 / square_ : 0.0;
    rest_ = 1 - c * c;
    lit_share_ = std::clamp((1 - terminator(0, 1)) / 2, 0.0, 1.0);
}

double LitDisc::terminator(double y, double half) const {
    if (all_lit_ || -half * sun_x_ > limb_) return -half;
    const double root2 = rest_ - square_ * y * y;
    if (root2 < 0) return half;
    return std::clamp((sun_x_ * limb_ + slant_ * std::sqrt(root2)) * inverse_square_, -half, half);
}

LitDisc::Piece LitDisc::piece(Part part, double y, double half) const {
    const double cut = terminator(y, half);
    const double x = half_at_least_ ? std::min(cut, 0.0) : cut;
    return part == Part::lit ? Piece{x, half - x} : Piece{-half, x + half};
}

double LitDisc::sample(Part part, double u, double v, Vec3& direction) const {
    double across;
    double y;
    concentric(u, v, across, y);
    const double half = std::sqrt(std::max(0.0, 1 - y * y));
    if (!(half > 0) || limb_tangent_ == 0) return 0;
    const Piece in = piece(part, y, half);
    const double share = in.width / (2 * half);
    if (!(share > 0)) return 0;
    const double x = in.from + std::clamp(across / half + 1, 0.0, 2.0) / 2 * in.width;
    const Vec3 to = scaled(z_axis_ + (x_axis_ * x + y_axis_ * y) * limb_tangent_, radii_m_);
    const double distance = length(to);
    direction = to / distance;
    return std::numbers::pi * share * scale_m3_ / (distance * distance * distance);
}

double LitDisc::inverse_pdf_sr(Part part, Vec3 direction) const {
    if (limb_tangent_ == 0) return 0;
    const Vec3 d{direction.x / radii_m_.x, direction.y / radii_m_.y, direction.z / radii_m_.z};
    const double along = dot(d, z_axis_);
    if (!(along > 0)) return 0;
    const double x = dot(d, x_axis_) / (along * limb_tangent_);
    const double y = dot(d, y_axis_) / (along * limb_tangent_);
    const double half2 = 1 - y * y;
    if (!(half2 > 0) || x * x > half2) return 0;
    const double half = std::sqrt(half2);
    const Piece in = piece(part, y, half);
    if (!(in.width > 0) || x < in.from || x > in.from + in.width) return 0;
    return std::numbers::pi * in.width / (2 * half) * scale_m3_ * (along * along * along);
}

} // namespace obscura::renderer
