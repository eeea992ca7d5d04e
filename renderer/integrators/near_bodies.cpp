// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/near_bodies.hpp"

#include "renderer/packets/frames.hpp"

namespace obscura::renderer {
namespace {

OBSCURA_VECTOR_CLONES
void within_chord(const Vec3s& direction, Vec3 axis, double chord2, Lanes& near) {
    for (int i = 0; i < packet_size; ++i) {
        const double x = direction.x.v[i] - axis.x;
        const double y = direction.y.v[i] - axis.y;
        const double z = direction.z.v[i] - axis.z;
        near.on[i] = x * x + y * y + z * z <= chord2 ? -1 : 0;
    }
}

/// Bound of an angle between camera rays in the frame of a body.
double in_frame(const BodyState& body, double angle_rad) {
    return body.seen.moves() ? angle_rad * (1 + 2 * length(body.beta)) : angle_rad;
}

} // namespace

bool near_axis(const Vec3s& direction, Vec3 axis, double chord2, Lanes& near) {
    within_chord(direction, axis, chord2, near);
    return near.any();
}

bool near_body(const BodyState& body, const Vec3s& direction, double chord2, double slack_rad, Lanes& near) {
    if (!near_axis(direction, body.direction, chord2, near)) return false;
    if (body.targeted) return true;
    RayPacket rays;
    if (body.seen.moves())
        transform_tilted(body.from_camera, direction, body.beta, rays.direction, rays.stretch);
    else
        transform(body.from_camera, direction, {}, rays.direction);
    set_all(rays.origin, body.camera_m);
    body.shape->cull(rays, in_frame(body, slack_rad), near);
    return near.any();
}

bool near_cone_at(const Instants& instants, std::int32_t index, const Words& instant, const Vec3s& direction,
                  Lanes& near) {
    for (int i = 0; i < packet_size; ++i) {
        const BodyState& body = instants.body(index, instant, i);
        const Vec3 d = direction.lane(i) - body.direction;
        near.on[i] = !body.targeted && dot(d, d) <= body.reach_chord2 ? -1 : 0;
    }
    return near.any();
}

bool near_hull_at(const Instants& instants, std::int32_t index, const Words& instant, const Vec3s& direction,
                  Lanes& near) {
    const RowState& row = instants.front();
    RayPacket rays;
    instants.from_camera(index, instant, direction, rays);
    const BodyState& body = row.bodies[static_cast<std::size_t>(index)];
    body.shape->cull(rays, in_frame(body, row.reach_rad), near);
    return near.any();
}

} // namespace obscura::renderer
