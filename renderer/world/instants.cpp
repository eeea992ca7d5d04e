// SPDX-License-Identifier: Apache-2.0
#include "renderer/world/instants.hpp"

#include "renderer/lights/sunlight.hpp"
#include "renderer/packets/frames.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace obscura::renderer {

void Instants::from_camera(std::int32_t index, const Words& instant, const Vec3s& direction,
                           RayPacket& rays) const {
    rays.detail = front().bodies[static_cast<std::size_t>(index)].detail_view();
    rays.origin_error_m = front().bodies[static_cast<std::size_t>(index)].camera_error_m;
    rays.stretched = moves(index);
    if (one()) {
        const BodyState& b = front().bodies[static_cast<std::size_t>(index)];
        if (rays.stretched)
            transform_tilted(b.from_camera, direction, b.beta, rays.direction, rays.stretch);
        else
            transform(b.from_camera, direction, {}, rays.direction);
        set_all(rays.origin, b.camera_m);
        return;
    }
    for (int i = 0; i < packet_size; ++i) {
        const BodyState& b = body(index, instant, i);
        Vec3 d = b.from_camera * direction.lane(i);
        if (rays.stretched) {
            d = d + b.beta;
            rays.stretch[i] = length(d);
            d = d / rays.stretch[i];
        }
        rays.direction.set(i, d);
        rays.origin.set(i, b.camera_m);
    }
}

bool Instants::moves(std::int32_t body) const {
    return std::any_of(states_.begin(), states_.end(), [&](const RowState& row) {
        return row.bodies[static_cast<std::size_t>(body)].seen.moves();
    });
}

void Instants::between(std::int32_t from, std::int32_t to, const Words& instant, const Vec3s& origin,
                       const Vec3s& direction, const Doubles& path_m, RayPacket& out) const {
    out.detail = front().bodies[static_cast<std::size_t>(to)].detail_view();
    out.stretched = moves(from) || moves(to);
    if (out.stretched) {
        for (int i = 0; i < packet_size; ++i) {
            const BodyState& a = body(from, instant, i);
            const BodyState& b = body(to, instant, i);
            const Vec3 offset_m = a.seen.position_at(path_m[i]) - b.seen.position_at(path_m[i]);
            out.origin.set(i, b.from_inertial * (a.to_inertial * origin.lane(i) + offset_m));
            out.direction.set(i, relative_direction(a, b, direction.lane(i), out.stretch[i]));
        }
        return;
    }
    if (one()) {
        const BodyState& a = front().bodies[static_cast<std::size_t>(from)];
        const BodyState& b = front().bodies[static_cast<std::size_t>(to)];
        const Mat3 turn = relative_rotation(a, b);
        transform(turn, origin, relative_origin(a, b, 0), out.origin);
        transform(turn, direction, {}, out.direction);
        return;
    }
    for (int i = 0; i < packet_size; ++i) {
        const BodyState& a = body(from, instant, i);
        const BodyState& b = body(to, instant, i);
        const Vec3 offset_m = a.seen.pose.position_m - b.seen.pose.position_m;
        out.origin.set(i, b.from_inertial * (a.to_inertial * origin.lane(i) + offset_m));
        out.direction.set(i, b.from_inertial * (a.to_inertial * direction.lane(i)));
    }
}

void Instants::to_inertial(std::int32_t index, const Words& instant, const Vec3s& in, Vec3s& out) const {
    if (one()) {
        transform(front().bodies[static_cast<std::size_t>(index)].to_inertial, in, {}, out);
        return;
    }
    for (int i = 0; i < packet_size; ++i)
        out.set(i, body(index, instant, i).to_inertial * in.lane(i));
}

void Instants::directions_to_inertial(std::int32_t index, const Words& instant, const Vec3s& in,
                                      Vec3s& out) const {
    to_inertial(index, instant, in, out);
    if (!moves(index)) return;
    for (int i = 0; i < packet_size; ++i)
        out.set(i, normalized(untilted(out.lane(i), body(index, instant, i).seen.beta)));
}

void Instants::sample_sun(std::int32_t index, const Words& instant, const Vec3s& position,
                          const scene::Sun& sun, const Doubles& u, const Doubles& v, Vec3s& direction,
                          Doubles& solid_angle_sr) const {
    if (one()) {
        renderer::sample_sun(position, front().bodies[static_cast<std::size_t>(index)].sun_m, sun, u, v,
                             direction, solid_angle_sr);
        return;
    }
    // About the Sun, so that it is at the same place for all lanes.
    Vec3s about_sun;
    for (int i = 0; i < packet_size; ++i)
        about_sun.set(i, position.lane(i) - body(index, instant, i).sun_m);
    renderer::sample_sun(about_sun, {0, 0, 0}, sun, u, v, direction, solid_angle_sr);
}

void join_instants(std::span<RowState> states, std::vector<SweptBody>& swept) {
    swept.clear();
    if (states.size() < 2) return;
    const RowState& middle = states[states.size() / 2];
    for (std::size_t b = 0; b < middle.bodies.size(); ++b) {
        // Bodies share a frame if they do at every instant.
        const auto own = static_cast<std::int32_t>(b);
        const bool shared = std::none_of(states.begin(), states.end(),
                                         [&](const RowState& s) { return s.bodies[b].frame == own; });
        std::vector<std::int32_t>& occluders = states.front().bodies[b].occluders;
        SweptBody body;
        body.direction = middle.bodies[b].direction;
        double chord = 0;
        for (RowState& state : states) {
            BodyState& s = state.bodies[b];
            s.detail = middle.bodies[b].detail;
            s.frame = shared ? state.bodies[b - 1].frame : own;
            for (const std::int32_t o : s.occluders)
                if (const auto at = std::lower_bound(occluders.begin(), occluders.end(), o);
                    at == occluders.end() || *at != o)
                    occluders.insert(at, o);
            if (s.reach_chord2 >= 4)
                chord = 3; // every direction
            else
                chord = std::max(chord, length(s.direction - body.direction) + std::sqrt(s.reach_chord2) +
                                            length(state.beta - middle.beta));
            if (s.targeted) continue;
            body.samples = std::max(body.samples, s.samples);
            if (body.brightest == nullptr || s.reference_radiance > body.brightest->reference_radiance)
                body.brightest = &s;
            body.large = body.large && s.large;
            body.small = body.small || s.small;
        }
        body.reach_chord2 = chord * chord;
        swept.push_back(body);
        for (RowState& state : states.subspan(1))
            state.bodies[b].occluders = occluders;
    }
}

} // namespace obscura::renderer
