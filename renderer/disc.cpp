#include "renderer/disc.hpp"

namespace obscura::renderer {

Disc::Disc(const scene::Disc& d)
    : AnalyticShape(d.radius_m * (1 + 1e-12)),
      outer2_(d.radius_m * d.radius_m),
      inner2_(d.inner_radius_m * d.inner_radius_m) {}

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
