// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/single_ray.hpp"

namespace obscura::renderer {

double distance_along(const Shape& shape, Vec3 origin, Vec3 direction) {
    RayPacket rays;
    HitPacket hits;
    hits.clear();
    for (int i = 0; i < packet_size; ++i) {
        rays.origin.set(i, origin);
        rays.direction.set(i, direction);
        rays.t_max[i] = no_hit;
        rays.active.on[i] = i == 0 ? -1 : 0;
    }
    shape.intersect(rays, 0, hits);
    return hits.t[0];
}

} // namespace obscura::renderer
