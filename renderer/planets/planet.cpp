// SPDX-License-Identifier: Apache-2.0
#include "renderer/planets/planet.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {

Planet::Planet(Vec3 radii_m, HeightField field)
    : inverse_radii_{1 / radii_m.x, 1 / radii_m.y, 1 / radii_m.z},
      field_(std::move(field)),
      bounding_radius_m_(std::max({radii_m.x, radii_m.y, radii_m.z}) * (1 + field_.largest()) * (1 + 1e-12)) {
}

void Planet::intersect(const RayPacket& rays, std::int32_t body, HitPacket& hits) const {
    for (int i = 0; i < packet_size; ++i) {
        if (rays.active.on[i] == 0) continue;
        const HeightField::Crossing crossing = field_.first_crossing(
            scaled(rays.origin.lane(i)), scaled(rays.direction.lane(i)), std::min(rays.t_max[i], hits.t[i]));
        if (crossing.t == no_hit) continue;
        hits.t[i] = crossing.t;
        hits.body[i] = body;
        hits.primitive[i] = crossing.cell;
        hits.u[i] = static_cast<float>(crossing.s);
        hits.v[i] = static_cast<float>(crossing.r);
    }
}

void Planet::occlude(RayPacket& rays) const {
    for (int i = 0; i < packet_size; ++i)
        if (rays.active.on[i] != 0 &&
            field_.first_crossing(scaled(rays.origin.lane(i)), scaled(rays.direction.lane(i)), rays.t_max[i])
                    .t != no_hit)
            rays.active.on[i] = 0;
}

void Planet::surface(const RayPacket& rays, const HitPacket& hits, std::int32_t body,
                     SurfacePacket& out) const {
    for (int i = 0; i < packet_size; ++i) {
        const Vec3 direction = rays.direction.lane(i);
        const bool hit = hits.body[i] == body;
        const double t = hit ? hits.t[i] : 0.0;
        const Vec3 point = rays.origin.lane(i) + t * direction;
        const HeightField::Gradients gradients =
            field_.gradients(hit ? hits.primitive[i] : 0, static_cast<double>(hit ? hits.u[i] : 0.0F),
                             static_cast<double>(hit ? hits.v[i] : 0.0F));
        Vec3 facet = normalized(scaled(gradients.facet));
        Vec3 normal = normalized(scaled(gradients.smooth));
        const bool outside = dot(facet, direction) <= 0;
        if (!outside) {
            facet = -facet;
            normal = -normal;
        }
        out.position.set(i, point);
        out.normal.set(i, normal);
        out.facet_normal.set(i, facet);
        out.outside.on[i] = outside ? -1 : 0;
        // Secondary rays start clear of the rounding of the crossing, which is that of the body's size and of
        // the distance travelled so far.
        out.shadow_origin.set(i, point + (1e-10 * bounding_radius_m_ + 1e-13 * t) * facet);
    }
}

} // namespace obscura::renderer
