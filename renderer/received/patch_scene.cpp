// SPDX-License-Identifier: Apache-2.0
#include "renderer/received/patch_scene.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Sets the factors and the emission of the patches of a body whose textures vary them.
void read_textures(const BuiltBody& built, std::size_t bands, PatchBody& body) {
    const SurfaceTextures& textures = *built.textures;
    const Receivers& receivers = *body.receivers;
    const std::size_t patches = receivers.patches().size();
    const std::vector<float> colour = body.factor, own = body.emission;
    body.factor.assign(patches * bands, 0);
    const bool shines = !own.empty();
    if (shines) body.emission.assign(patches * bands, 0);
    Doubles middle;
    std::fill_n(middle.v, packet_size, 0.5);
    PatchPoints at;
    for (std::size_t p = 0; p < receivers.packets(); ++p) {
        receivers.points(p, middle, middle, 1, at);
        Doubles width_m;
        for (int i = 0; i < packet_size; ++i)
            width_m[i] = std::sqrt(at.area_m2[i]);
        SurfacePacket turned = at.surface;
        Channels factor, emission;
        ParameterPacket varied;
        textures.apply(*built.shape, at.view, at.hits, body.index, width_m, bands, {}, turned, factor,
                       varied);
        const bool mapped = shines && textures.varies_emission();
        if (mapped)
            textures.emission(*built.shape, at.view, at.hits, body.index, width_m, bands, {}, at.surface,
                              emission);
        for (std::size_t i = 0; i < at.count; ++i)
            for (std::size_t b = 0; b < bands; ++b) {
                const std::size_t k = at.patch[i] * bands + b;
                body.factor[k] = colour[b] * static_cast<float>(factor.v[b].v[i]);
                if (shines) body.emission[k] = own[b] * (mapped ? static_cast<float>(emission.v[b].v[i]) : 1);
            }
    }
}

} // namespace

std::size_t PatchScene::body_of(std::size_t patch) const {
    const auto next = std::upper_bound(bodies.begin(), bodies.end(), patch,
                                       [](std::size_t p, const PatchBody& body) { return p < body.first; });
    return static_cast<std::size_t>(next - bodies.begin()) - 1;
}

PatchScene make_patch_scene(const BuiltScene& built, std::size_t rows) {
    PatchScene out;
    out.built = &built;
    out.bands = built.scene.bands.size();
    out.place_of.assign(built.bodies.size(), -1);
    for (std::size_t i = 0; i < built.bodies.size(); ++i) {
        const BuiltBody& from = built.bodies[i];
        if (from.material == nullptr) continue; // the Sun
        PatchBody body;
        body.index = static_cast<std::int32_t>(i);
        body.receivers = std::make_shared<Receivers>(from, body.index, rows);
        body.first = out.patches;
        body.table = std::make_shared<ReflectanceTable>(*from.material, out.bands);
        for (std::size_t b = 0; b < out.bands; ++b) {
            body.factor.push_back(from.colour.empty() ? 1.0F : static_cast<float>(from.colour[b]));
            if (!from.emission.empty()) body.emission.push_back(static_cast<float>(from.emission[b]));
        }
        if (from.textures) read_textures(from, out.bands, body);
        out.mirrors = out.mirrors || body.table->mirror();
        out.place_of[i] = static_cast<std::int32_t>(out.bodies.size());
        out.patches += body.receivers->patches().size();
        out.bodies.push_back(std::move(body));
    }
    return out;
}

PatchRays::LampPlace PatchRays::lamp(const PatchBody& body, std::size_t number) const {
    const BodyState& own = state(body);
    const ApparentBody& lamp = row_.lamps[number];
    return {own.from_inertial * (lamp.position_at(0) - own.seen.position_at(0)),
            own.from_inertial * rotate(lamp.pose.orientation, {0, 0, 1})};
}

void PatchRays::occlude(const PatchBody& body, std::span<const std::int32_t> others, RayPacket& rays) const {
    if (!rays.active.any()) return;
    const Shape& own = *state(body).shape;
    std::fill_n(rays.level_u.v, packet_size, 0.5);
    if (own.shadows_itself()) own.occlude(rays);
    const Doubles path{};
    for (const std::int32_t other : others) {
        if (!rays.active.any()) return;
        RayPacket moved;
        instants_.between(body.index, other, {}, rays.origin, rays.direction, path, moved);
        moved.t_max = rays.t_max;
        moved.active = rays.active;
        moved.coherent = rays.coherent;
        moved.level_u = rays.level_u;
        row_.bodies[static_cast<std::size_t>(other)].shape->occlude(moved);
        rays.active = moved.active;
    }
}

void PatchRays::nearest(std::int32_t frame, const RayPacket& rays, HitPacket& hits) const {
    hits.clear();
    const Doubles path{};
    for (const PatchBody& other : scene_.bodies) {
        RayPacket moved;
        instants_.between(frame, other.index, {}, rays.origin, rays.direction, path, moved);
        moved.t_max = rays.t_max;
        moved.active = rays.active;
        moved.coherent = rays.coherent;
        std::fill_n(moved.level_u.v, packet_size, 0.5);
        state(other).shape->intersect(moved, other.index, hits);
    }
}

void PatchRays::patches(std::int32_t frame, const RayPacket& rays, const HitPacket& hits,
                        PatchHit (&out)[packet_size]) const {
    const Doubles path{};
    Lanes left = rays.active;
    for (int i = 0; i < packet_size; ++i) {
        out[i] = {};
        if (hits.body[i] < 0) left.on[i] = 0;
    }
    for (int i = 0; i < packet_size; ++i) {
        if (left.on[i] == 0) continue;
        const std::int32_t index = hits.body[i];
        RayPacket moved;
        instants_.between(frame, index, {}, rays.origin, rays.direction, path, moved);
        const PatchBody& body =
            scene_.bodies[static_cast<std::size_t>(scene_.place_of[static_cast<std::size_t>(index)])];
        for (int k = i; k < packet_size; ++k) {
            if (left.on[k] == 0 || hits.body[k] != index) continue;
            left.on[k] = 0;
            const Vec3 direction = moved.direction.lane(k);
            const std::size_t patch =
                body.receivers->patch_at(hits.primitive[k], moved.origin.lane(k) + hits.t[k] * direction);
            const bool inner = dot(direction, body.receivers->patches()[patch].normal) >= 0;
            out[k].patch = inner && body.receivers->facets() ? PatchHit::inner_side
                                                             : static_cast<std::uint32_t>(body.first + patch);
        }
    }
}

} // namespace obscura::renderer
