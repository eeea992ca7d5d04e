#include "renderer/shapes/disc.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {

Disc::Disc(const scene::Disc& d)
    : AnalyticShape(d.radius_m * (1 + 1e-12)),
      outer2_(d.radius_m * d.radius_m),
      inner2_(d.inner_radius_m * d.inner_radius_m),
      inner_m_(d.inner_radius_m),
      breadth_m_(d.radius_m - d.inner_radius_m) {}

bool Disc::chart(const HitPacket& hits, std::int32_t body, const SurfacePacket& surface,
                 ChartPacket& out) const {
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
