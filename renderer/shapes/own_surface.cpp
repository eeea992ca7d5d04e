// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/own_surface.hpp"

namespace obscura::renderer {

Lanes leaving(const Shape& shape, const RayPacket& rays, std::int32_t body, const HitRounding& rounding,
              const Lanes& asked, const HitPacket& hits) {
    SurfacePacket surface;
    shape.surface(rays, hits, body, surface);
    const double depth_m = rounding.depth_m + rays.origin_error_m;
    Lanes out;
    for (int i = 0; i < packet_size; ++i) {
        // From inside: the normal, which faces the ray, is the inner one.
        const double depth =
            dot(rays.origin.lane(i) - surface.position.lane(i), surface.facet_normal.lane(i));
        out.on[i] = asked.on[i] != 0 && surface.outside.on[i] == 0 && depth <= depth_m ? -1 : 0;
    }
    return out;
}

} // namespace obscura::renderer
