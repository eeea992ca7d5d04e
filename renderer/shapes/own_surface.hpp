// SPDX-License-Identifier: Apache-2.0
// Rays that start on a surface: what they leave through is no hit.
#pragma once

#include "renderer/shapes/shape.hpp"

namespace obscura::renderer {

/// Depth below a surface that is rounding, in units of the body's size: some units in the last place, after a
/// rotation. 0.25 um on Jupiter, 6 nm on the Moon.
inline constexpr double surface_rounding = 0x1p-48;

/// Rounding of a shape's hits.
struct HitRounding {
    double depth_m; ///< origins no deeper are on the surface
    double reach_m; ///< further hits are not of the surface on which a ray starts, even at grazing angles
    double step_m;  ///< rounding of the distances of hits
};

/// That of a shape in double precision of this size.
[[nodiscard]] constexpr HitRounding double_rounding(double radius_m) {
    return {4 * surface_rounding * radius_m, 1e-6 * radius_m, 1e-13 * radius_m};
}
/// That of a shape whose rays are traced in floats, and whose surface() is precise.
[[nodiscard]] constexpr HitRounding float_rounding(double radius_m) {
    return {4 * surface_rounding * radius_m, 1e-3 * radius_m, 0x1p-21 * radius_m};
}

/// Those of the lanes `asked`, hits of `body`, at which a ray leaves the surface that it starts on.
[[nodiscard]] Lanes leaving(const Shape& shape, const RayPacket& rays, std::int32_t body,
                            const HitRounding& rounding, const Lanes& asked, const HitPacket& hits);

/// Drops those of `hits`, that Shape::intersect() of `shape` has found since they were `before`, at which a
/// ray leaves the surface that it starts on, and finds the next ones instead. `trace(rays, hits)`: as
/// Shape::intersect().
template<typename Trace>
void leave_own_surface(const Shape& shape, const RayPacket& rays, std::int32_t body,
                       const HitRounding& rounding, const HitPacket& before, HitPacket& hits,
                       const Trace& trace) {
    Lanes near;
    for (int i = 0; i < packet_size; ++i)
        near.on[i] = hits.t[i] < before.t[i] && hits.t[i] < rounding.reach_m ? -1 : 0;
    constexpr int max_steps = 8; // surfaces that meet where the ray starts
    for (int step = 0; step < max_steps && near.any(); ++step) {
        near = leaving(shape, rays, body, rounding, near, hits);
        if (!near.any()) return;
        // Go on behind the hit.
        RayPacket rest = rays;
        rest.active = near;
        HitPacket next = before;
        Doubles passed;
        for (int i = 0; i < packet_size; ++i) {
            passed[i] = near.on[i] != 0 ? hits.t[i] + rounding.step_m : 0;
            rest.origin.set(i, rays.origin.lane(i) + passed[i] * rays.direction.lane(i));
            rest.t_max[i] -= passed[i];
            next.t[i] -= passed[i];
        }
        trace(rest, next);
        for (int i = 0; i < packet_size; ++i) {
            if (near.on[i] == 0) continue;
            const bool found = next.t[i] + passed[i] < before.t[i];
            hits.t[i] = found ? next.t[i] + passed[i] : before.t[i];
            hits.body[i] = next.body[i];
            hits.primitive[i] = next.primitive[i];
            hits.u[i] = next.u[i];
            hits.v[i] = next.v[i];
            if (!(found && hits.t[i] < rounding.reach_m)) near.on[i] = 0;
        }
    }
}

} // namespace obscura::renderer
