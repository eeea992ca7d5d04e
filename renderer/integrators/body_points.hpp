// SPDX-License-Identifier: Apache-2.0
// Points of light on the disc of a small body: directions sampled in its lit or its dark part, and traced.
#pragma once

#include "renderer/camera/projection.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/packets/frames.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/shapes/lit_disc.hpp"
#include "renderer/world/row_state.hpp"

#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Samples [first, first + count) of `of` in one part of a body's disc; `count` is a multiple of 16.
struct DiscPoints {
    const RowState& row;
    std::int32_t body;
    LitDisc::Part part;
    std::uint32_t first, count, of, seed;
};

/// Whether the dark part shines: by itself or by what is not sunlight, or with normals of its own.
[[nodiscard]] inline bool dark_part_shines(const BodyState& body, const Tracer& tracer) {
    return !body.disc.exact() || !tracer.sunlight_only() ||
           (body.built->textures != nullptr && body.built->textures->turns_normals());
}

/// Fills `candidates` with what may hide body `index`: bodies whose bounding cones meet, and itself.
inline void find_occluders(const RowState& row, std::int32_t index, std::vector<std::int32_t>& candidates) {
    const BodyState& body = row.bodies[static_cast<std::size_t>(index)];
    candidates.clear();
    for (std::size_t b = 0; b < row.bodies.size(); ++b) {
        const BodyState& other = row.bodies[b];
        const double reach_cos = body.cos_cone * other.cos_cone - body.cone_sine * other.cone_sine;
        if (static_cast<std::int32_t>(b) == index || other.cos_cone < 0 ||
            dot(other.direction, body.direction) >= reach_cos)
            candidates.push_back(static_cast<std::int32_t>(b));
    }
}

/// Calls `use(at, amount)` with the image point and the light, by channel, of every sample that hits the body
/// and for which `wanted(at)` was true. `candidates`: see find_occluders().
template<typename Wanted, typename Use>
void trace_disc(const DiscPoints& points, const Projection& lens, std::span<const std::int32_t> candidates,
                Tracer& tracer, const Wanted& wanted, const Use& use) {
    const BodyState& body = points.row.bodies[static_cast<std::size_t>(points.body)];
    tracer.set_ray_width(std::sqrt(body.solid_angle_sr / points.of));
    const Mat3 to_camera = transposed(body.from_camera);
    CameraRays rays;
    ImagePoint at[packet_size];
    double weight[packet_size];
    int filled = 0;
    set_all(rays.direction, body.direction);
    for (int i = 0; i < packet_size; ++i) {
        rays.index.v[i] = 0;
        rays.light_seed.v[i] = points.seed;
    }
    const auto trace = [&] {
        // Trace the rays and keep what hits the body.
        Lanes active;
        for (int i = 0; i < packet_size; ++i)
            active.on[i] = i < filled ? -1 : 0;
        filled = 0;
        tracer.intersect(rays.direction, active, candidates, rays.hits);
        tracer.count_samples(active);
        for (std::int32_t& hit : rays.hits.body)
            hit = hit == points.body ? hit : -1;
        tracer.radiance({&rays, 1});
        for (int i = 0; i < packet_size; ++i) {
            if (rays.hits.body[i] < 0) continue;
            double amount[max_channels];
            for (std::size_t c = 0; c < tracer.channels(); ++c)
                amount[c] = weight[i] * rays.radiance.v[c].v[i];
            use(at[i], std::span<const double>(amount, tracer.channels()));
        }
    };
    Words index_of;
    for (std::uint32_t first = points.first; first < points.first + points.count; first += packet_size) {
        for (std::uint32_t i = 0; i < packet_size; ++i)
            index_of.v[i] = first + i;
        Doubles u;
        Doubles v;
        // Together with the points of the Sun's disc, the first pair of the samples' numbers: in a thin
        // crescent the light depends on both.
        sobol_second_pair(index_of, rays.light_seed, u, v);
        for (int i = 0; i < packet_size; ++i) {
            Vec3 direction;
            const double solid_angle_sr = body.disc.sample(points.part, u.v[i], v.v[i], direction);
            if (!(solid_angle_sr > 0)) continue;
            direction = to_camera * direction;
            const auto point = lens.project(direction);
            if (!point || !wanted(*point)) continue;
            rays.direction.set(filled, direction);
            rays.index.v[filled] = index_of.v[i];
            at[filled] = *point;
            weight[filled] = solid_angle_sr / points.of * lens.transmission(direction);
            if (++filled == packet_size) trace();
        }
    }
    if (filled > 0) trace();
}

} // namespace obscura::renderer
