// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/analytic_shape.hpp"

#include "renderer/shapes/own_surface.hpp"

#include <cmath>

namespace obscura::renderer {

bool AnalyticShape::leaves(Vec3 origin, Vec3 direction, Crossing crossing, double origin_error_m) const {
    // Beyond, not even grazing rays are on the surface.
    if (crossing.t > 1e-3 * bounding_radius_m_) return false;
    const double outwards = dot(normal(origin + crossing.t * direction, crossing.face), direction);
    const double depth_m = crossing.t * std::abs(outwards);
    return (outwards > 0 || !has_inside()) &&
           depth_m <= 2 * surface_rounding * bounding_radius_m_ + origin_error_m;
}

AnalyticShape::Crossing AnalyticShape::nearest(Vec3 origin, Vec3 direction, double limit,
                                               double origin_error_m) const {
    const double along = -dot(origin, direction);
    const Vec3 closest = origin + along * direction;
    if (length_squared(closest) > bounding_radius_m_ * bounding_radius_m_) return {};
    Crossing best;
    const Crossings all = crossings(closest, direction);
    for (std::size_t k = 0; k < all.count; ++k) {
        const double t = along + all.at[k].t;
        const Crossing found{t, all.at[k].face};
        if (t > 0 && t < limit && t < best.t && !leaves(origin, direction, found, origin_error_m))
            best = found;
    }
    return best;
}

void AnalyticShape::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    for (int i = 0; i < packet_size; ++i) {
        if (rays.active.on[i] == 0) continue;
        const double limit = rays.t_max[i] < hits.t[i] ? rays.t_max[i] : hits.t[i];
        const Crossing c = nearest(rays.origin.lane(i), rays.direction.lane(i), limit, rays.origin_error_m);
        if (c.t == no_hit) continue;
        hits.t[i] = c.t;
        hits.body[i] = body;
        hits.primitive[i] = c.face;
    }
}

void AnalyticShape::occlude(RayPacket& rays) const {
    for (int i = 0; i < packet_size; ++i)
        if (rays.active.on[i] != 0 &&
            nearest(rays.origin.lane(i), rays.direction.lane(i), rays.t_max[i], rays.origin_error_m).t !=
                no_hit)
            rays.active.on[i] = 0;
}

void AnalyticShape::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                            SurfacePacket& out) const {
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 d = rays.direction.lane(i);
        const double t = hits.body[i] == body ? hits.t[i] : 0.0;
        const Vec3 point = rays.origin.lane(i) + t * d;
        Vec3 n = normal(point, hits.body[i] == body ? hits.primitive[i] : 0);
        const bool behind = dot(n, d) > 0;
        if (behind) n = -n;
        out.position.set(i, point);
        out.normal.set(i, n);
        out.facet_normal.set(i, n);
        out.outside.on[i] = behind && has_inside() ? 0 : -1;
        // Secondary rays start clear of the surface by some units in the last place.
        out.shadow_origin.set(i, point + 1e-13 * (bounding_radius_m_ + t) * n);
    }
}

} // namespace obscura::renderer
