// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/disc.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {

scene::ParameterList declare(DiscParameters& p) {
    return {
        config::key("radius_m", &p.radius_m)
            .unit("m")
            .range(1e-6, 1e12)
            .required()
            .help("Outer radius of the disc"),
        config::key("inner_radius_m", &p.inner_radius_m)
            .unit("m")
            .range(0, 1e12)
            .help("Radius of the hole in the disc, less than the outer one; 0: no hole"),
    };
}

std::vector<scene::Conflict> conflicts_in(const DiscParameters& p) {
    if (p.inner_radius_m < p.radius_m) return {};
    return {{"inner_radius_m",
             fmt::format("{} m: allowed is less than the outer radius, {} m", p.inner_radius_m, p.radius_m)}};
}

std::shared_ptr<const Shape> make(const DiscParameters& p, ShapeContext& /*context*/) {
    return std::make_shared<Disc>(p);
}

Disc::Disc(const DiscParameters& d)
    : AnalyticShape(d.radius_m * (1 + 1e-12)),
      outer2_(d.radius_m * d.radius_m),
      inner2_(d.inner_radius_m * d.inner_radius_m),
      inner_m_(d.inner_radius_m),
      breadth_m_(d.radius_m - d.inner_radius_m) {}

bool Disc::texture_coordinates(const HitPacket& hits, std::int32_t body, const SurfacePacket& surface,
                               UvPacket& out) const {
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 p = hits.body[i] == body ? surface.position.lane(i) : Vec3{};
        const double r = std::max(std::sqrt(p.x * p.x + p.y * p.y), 1e-9 * breadth_m_);
        out.u[i] = std::atan2(p.y, p.x) / (2 * std::numbers::pi);
        out.v[i] = (r - inner_m_) / breadth_m_;
        out.grad_u.set(i, Vec3{-p.y, p.x, 0} / (2 * std::numbers::pi * r * r));
        out.grad_v.set(i, Vec3{p.x, p.y, 0} / (r * breadth_m_));
    }
    return true;
}

AnalyticShape::Crossings Disc::crossings(Vec3 o, Vec3 d) const {
    Crossings all;
    if (d.z == 0) return all;
    const double t = -o.z / d.z;
    const double x = o.x + t * d.x;
    const double y = o.y + t * d.y;
    const double r2 = x * x + y * y;
    if (r2 <= outer2_ && r2 >= inner2_) all.add(t, 0);
    return all;
}

} // namespace obscura::renderer
