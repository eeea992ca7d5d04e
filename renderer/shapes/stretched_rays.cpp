// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/stretched_rays.hpp"

namespace obscura::renderer {

void intersect_stretched(const Shape& shape, const RayPacket& rays, std::int32_t body, HitPacket& hits) {
    if (!rays.stretched) {
        shape.intersect(rays, body, hits);
        return;
    }
    HitPacket own;
    const HitPacket before = hits_in_frame(rays, hits, own);
    shape.intersect(rays, body, own);
    for (int i = 0; i < packet_size; ++i) {
        if (!(own.t[i] < before.t[i])) continue;
        hits.t[i] = own.t[i] / rays.stretch[i];
        hits.body[i] = own.body[i];
        hits.primitive[i] = own.primitive[i];
        hits.u[i] = own.u[i];
        hits.v[i] = own.v[i];
    }
}

void stretch_limits(RayPacket& rays) {
    if (!rays.stretched) return;
    for (int i = 0; i < packet_size; ++i)
        rays.t_max[i] *= rays.stretch[i];
}

const HitPacket& hits_in_frame(const RayPacket& rays, const HitPacket& hits, HitPacket& scratch) {
    if (!rays.stretched) return hits;
    scratch = hits;
    for (int i = 0; i < packet_size; ++i)
        scratch.t[i] *= rays.stretch[i];
    return scratch;
}

} // namespace obscura::renderer
