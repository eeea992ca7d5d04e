// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/cone.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace obscura::renderer {

scene::ParameterList declare(ConeParameters& p) {
    return {
        config::key("bottom_radius_m", &p.bottom_radius_m)
            .unit("m")
            .range(0, 1e12)
            .required()
            .help("Radius at the lower end of the cone, at z = -height / 2"),
        config::key("top_radius_m", &p.top_radius_m)
            .unit("m")
            .range(0, 1e12)
            .required()
            .help("Radius at the upper end of the cone, at z = height / 2; one of the radii may be 0"),
        config::key("height_m", &p.height_m)
            .unit("m")
            .range(1e-6, 1e12)
            .required()
            .help("Length of the cone along z, its middle at the origin"),
    };
}

std::vector<scene::Conflict> conflicts_in(const ConeParameters& p) {
    if (p.bottom_radius_m + p.top_radius_m > 0) return {};
    return {{"bottom_radius_m", "0 m: allowed is more than 0 where the top radius is 0"}};
}

std::shared_ptr<const Shape> make(const ConeParameters& p, ShapeContext& /*context*/) {
    return std::make_shared<Cone>(p);
}

namespace {

enum Face : std::uint32_t { side, bottom, top };

} // namespace

Cone::Cone(const ConeParameters& d)
    : AnalyticShape(std::hypot(std::max(d.bottom_radius_m, d.top_radius_m), d.height_m / 2) * (1 + 1e-12)),
      bottom_(d.bottom_radius_m),
      top_(d.top_radius_m),
      half_height_(d.height_m / 2),
      middle_((d.bottom_radius_m + d.top_radius_m) / 2),
      slope_((d.top_radius_m - d.bottom_radius_m) / d.height_m) {}

AnalyticShape::Crossings Cone::crossings(Vec3 o, Vec3 d) const {
    Crossings all;
    // x^2 + y^2 = (middle + slope z)^2 along the ray: a t^2 + 2 b t + c = 0.
    const double radius = middle_ + slope_ * o.z;
    const double growth = slope_ * d.z;
    const double a = d.x * d.x + d.y * d.y - growth * growth;
    const double b = o.x * d.x + o.y * d.y - radius * growth;
    const double c = o.x * o.x + o.y * o.y - radius * radius;
    const auto add_side = [&](double t) {
        const double z = o.z + t * d.z;
        if (std::isfinite(t) && std::abs(z) <= half_height_ && middle_ + slope_ * z >= 0) all.add(t, side);
    };
    const double discriminant = b * b - a * c;
    if (discriminant > 0) {
        const double q = -(b + std::copysign(std::sqrt(discriminant), b));
        add_side(q / a);
        add_side(c / q);
    }
    if (d.z != 0)
        for (const Face face : {bottom, top}) {
            const double z = face == bottom ? -half_height_ : half_height_;
            const double r = face == bottom ? bottom_ : top_;
            const double t = (z - o.z) / d.z;
            const double x = o.x + t * d.x;
            const double y = o.y + t * d.y;
            if (x * x + y * y <= r * r) all.add(t, face);
        }
    return all;
}

Vec3 Cone::normal(Vec3 p, std::uint32_t face) const {
    if (face != side) return {0, 0, face == top ? 1.0 : -1.0};
    const double across = std::hypot(p.x, p.y);
    // The tip has no normal: use the axis.
    return across > 0 ? normalized(Vec3{p.x / across, p.y / across, -slope_}) : Vec3{0, 0, 1};
}

} // namespace obscura::renderer
