// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/ellipsoid.hpp"

#include "renderer/shapes/own_surface.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::renderer {

scene::ParameterList declare(EllipsoidParameters& p) {
    return {config::key("radii_m", &p.radii_m)
                .unit("m")
                .range(1e-6, 1e12)
                .required()
                .help("Three radii of the ellipsoid, along x, y and z of the body frame")};
}

std::shared_ptr<const Shape> make(const EllipsoidParameters& p, ShapeContext& /*context*/) {
    return std::make_shared<Ellipsoid>(p);
}

namespace {

/// Distance of a hit where the ray starts.
constexpr double tiny = std::numeric_limits<double>::min();

/// Distance to the nearest intersection in front of the origin, or no_hit. Origins on the surface, whose
/// squared distance differs from 1 by no more than `slack`, are outside.
OBSCURA_VECTOR_CLONES
void distances(const RayPacket& rays, Vec3 inverse_radii, double slack, Doubles& distance) {
    for (int i = 0; i < packet_size; ++i) {
        const double fx = rays.origin.x[i] * inverse_radii.x;
        const double fy = rays.origin.y[i] * inverse_radii.y;
        const double fz = rays.origin.z[i] * inverse_radii.z;
        const double dx = rays.direction.x[i] * inverse_radii.x;
        const double dy = rays.direction.y[i] * inverse_radii.y;
        const double dz = rays.direction.z[i] * inverse_radii.z;
        const double a = dx * dx + dy * dy + dz * dz;
        const double b = -(fx * dx + fy * dy + fz * dz);
        const double s = b / a;
        const double lx = fx + s * dx;
        const double ly = fy + s * dy;
        const double lz = fz + s * dz;
        const double discriminant = 1.0 - (lx * lx + ly * ly + lz * lz);
        const double c = fx * fx + fy * fy + fz * fz - 1.0;
        const double root = std::sqrt(a * (discriminant > 0 ? discriminant : 0.0));
        const double q = b + (b < 0 ? -root : root);
        const double t0 = c / q;
        const double t1 = q / a;
        const double near = t0 < t1 ? t0 : t1;
        const double far = t0 < t1 ? t1 : t0;
        const bool on = (c <= 0) & (c >= -slack);
        const double beyond = on ? tiny : far;
        const double t = near > 0 ? near : beyond;
        distance[i] = ((discriminant > 0) & (t > 0) & !(on & (b <= 0))) ? t : no_hit;
    }
}

} // namespace

Ellipsoid::Ellipsoid(const EllipsoidParameters& d)
    : radii_m_(d.radii_m),
      inverse_radii_{1 / d.radii_m.x, 1 / d.radii_m.y, 1 / d.radii_m.z},
      bounding_radius_m_(std::max({d.radii_m.x, d.radii_m.y, d.radii_m.z})) {}

double Ellipsoid::slack(const RayPacket& rays) const {
    const double smallest = std::max({inverse_radii_.x, inverse_radii_.y, inverse_radii_.z});
    return 2 * (surface_rounding + rays.origin_error_m * smallest);
}

void Ellipsoid::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    Doubles t;
    distances(rays, inverse_radii_, slack(rays), t);
    for (int i = 0; i < packet_size; ++i) {
        const bool nearer = rays.active.on[i] != 0 && t[i] < hits.t[i] && t[i] < rays.t_max[i];
        hits.t[i] = nearer ? t[i] : hits.t[i];
        hits.body[i] = nearer ? body : hits.body[i];
    }
}

void Ellipsoid::occlude(RayPacket& rays) const {
    Doubles t;
    distances(rays, inverse_radii_, slack(rays), t);
    for (int i = 0; i < packet_size; ++i)
        rays.active.on[i] = t[i] < rays.t_max[i] ? 0 : rays.active.on[i];
}

void Ellipsoid::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                        SurfacePacket& out) const {
    const Vec3 squared{inverse_radii_.x * inverse_radii_.x, inverse_radii_.y * inverse_radii_.y,
                       inverse_radii_.z * inverse_radii_.z};
    for (int i = 0; i < packet_size; ++i) {
        const double t = hits.body[i] == body ? hits.t[i] : 0.0;
        const double px = rays.origin.x[i] + t * rays.direction.x[i];
        const double py = rays.origin.y[i] + t * rays.direction.y[i];
        const double pz = rays.origin.z[i] + t * rays.direction.z[i];
        double nx = px * squared.x;
        double ny = py * squared.y;
        double nz = pz * squared.z;
        const double facing = nx * rays.direction.x[i] + ny * rays.direction.y[i] + nz * rays.direction.z[i];
        const double norm = nx * nx + ny * ny + nz * nz;
        const double scale = (facing > 0 ? -1.0 : 1.0) / std::sqrt(norm > 0 ? norm : 1.0);
        nx *= scale;
        ny *= scale;
        nz *= scale;
        out.position.x[i] = px;
        out.position.y[i] = py;
        out.position.z[i] = pz;
        out.normal.x[i] = out.facet_normal.x[i] = nx;
        out.normal.y[i] = out.facet_normal.y[i] = ny;
        out.normal.z[i] = out.facet_normal.z[i] = nz;
        out.outside.on[i] = facing > 0 ? 0 : -1;
        // Secondary rays start clear of the surface by some units in the last place of the size and of the
        // distance travelled so far.
        const double lift = 1e-13 * (bounding_radius_m_ + t);
        out.shadow_origin.x[i] = px + lift * nx;
        out.shadow_origin.y[i] = py + lift * ny;
        out.shadow_origin.z[i] = pz + lift * nz;
    }
}

} // namespace obscura::renderer
