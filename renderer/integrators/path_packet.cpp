// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/path_packet.hpp"

namespace obscura::renderer {
namespace {

/// Rotates `origin` + `start` - `body_m` and `direction` by `m`.
OBSCURA_VECTOR_CLONES
void turn_rays(const Mat3& m, const Vec3s& origin, const Vec3s& start, Vec3 body_m, const Vec3s& direction,
               RayPacket& out) {
    for (int i = 0; i < packet_size; ++i) {
        const double x = origin.x.v[i] + (start.x.v[i] - body_m.x);
        const double y = origin.y.v[i] + (start.y.v[i] - body_m.y);
        const double z = origin.z.v[i] + (start.z.v[i] - body_m.z);
        out.origin.x.v[i] = m.m[0][0] * x + m.m[0][1] * y + m.m[0][2] * z;
        out.origin.y.v[i] = m.m[1][0] * x + m.m[1][1] * y + m.m[1][2] * z;
        out.origin.z.v[i] = m.m[2][0] * x + m.m[2][1] * y + m.m[2][2] * z;
    }
    for (int i = 0; i < packet_size; ++i) {
        const double x = direction.x.v[i];
        const double y = direction.y.v[i];
        const double z = direction.z.v[i];
        out.direction.x.v[i] = m.m[0][0] * x + m.m[0][1] * y + m.m[0][2] * z;
        out.direction.y.v[i] = m.m[1][0] * x + m.m[1][1] * y + m.m[1][2] * z;
        out.direction.z.v[i] = m.m[2][0] * x + m.m[2][1] * y + m.m[2][2] * z;
    }
}

} // namespace

void to_body_frame(const Instants& instants, std::int32_t index, const PathPacket& paths, RayPacket& rays) {
    rays.detail = instants.front().bodies[static_cast<std::size_t>(index)].detail_view();
    rays.stretched = instants.moves(index);
    if (!instants.one() || rays.stretched) {
        for (int i = 0; i < packet_size; ++i) {
            const BodyState& body = instants.body(index, paths.instant, i);
            const Vec3 offset_m = paths.start.lane(i) - body.seen.position_at(paths.travelled_m[i]);
            rays.origin.set(i, body.from_inertial * (paths.origin.lane(i) + offset_m));
            Vec3 direction = paths.direction.lane(i);
            if (rays.stretched) {
                direction = direction + body.seen.beta;
                rays.stretch[i] = length(direction);
                direction = direction / rays.stretch[i];
            }
            rays.direction.set(i, body.from_inertial * direction);
        }
        return;
    }
    const BodyState& body = instants.front().bodies[static_cast<std::size_t>(index)];
    turn_rays(body.from_inertial, paths.origin, paths.start, body.seen.pose.position_m, paths.direction,
              rays);
}

std::size_t compact(std::span<PathPacket> paths, std::size_t channels) {
    std::size_t packet = 0; // next free packet and lane
    int lane = 0;
    for (std::size_t k = 0; k < paths.size(); ++k)
        for (int i = 0; i < packet_size; ++i) {
            const PathPacket& from = paths[k];
            if (from.alive.on[i] == 0) continue;
            if (k != packet || i != lane) {
                // Lanes are filled in order, so that no path is overwritten before it has moved.
                PathPacket& to = paths[packet];
                to.origin.set(lane, from.origin.lane(i));
                to.direction.set(lane, from.direction.lane(i));
                to.start.set(lane, from.start.lane(i));
                for (std::size_t c = 0; c < channels; ++c)
                    to.throughput.v[c][lane] = from.throughput.v[c][i];
                to.pdf[lane] = from.pdf[i];
                to.travelled_m[lane] = from.travelled_m[i] + from.hits.t[i];
                to.index[lane] = from.index[i];
                to.seed[lane] = from.seed[i];
                to.instant[lane] = from.instant[i];
                to.level_u[lane] = from.level_u[i];
                to.owner[lane] = from.owner[i];
                to.shone_on[lane] = from.shone_on[i];
                to.chain[lane] = from.chain[i];
            } else {
                paths[k].travelled_m[i] += from.hits.t[i];
            }
            lane = (lane + 1) % packet_size;
            packet += lane == 0 ? 1 : 0;
        }
    const std::size_t filled = packet + (lane > 0 ? 1 : 0);
    for (std::size_t k = 0; k < filled; ++k)
        for (int i = 0; i < packet_size; ++i)
            paths[k].alive.on[i] = k < packet || i < lane ? -1 : 0;
    return filled;
}

} // namespace obscura::renderer
