// SPDX-License-Identifier: Apache-2.0
// Points of light of a small body: directions sampled in a part of its disc, or points of its facets, traced.
#pragma once

#include "renderer/camera/projection.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/packets/frames.hpp"
#include "renderer/packets/sampler.hpp"
#include "renderer/shapes/lit_disc.hpp"
#include "renderer/shapes/lit_facets.hpp"
#include "renderer/world/row_state.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Samples [first, first + count) of the `of` of a body at one of the `instants` that share an exposure;
/// `count` is a multiple of 16.
struct BodySamples {
    const RowState& row;
    std::int32_t body;
    std::uint32_t first, count, of, seed;
    std::uint32_t instant = 0, instants = 1;

    /// Index into the sequences of random numbers, which go on from instant to instant.
    [[nodiscard]] std::uint32_t index(std::uint32_t sample) const { return instant * of + sample; }
    /// Share of a sample in the exposure.
    [[nodiscard]] double share() const { return 1.0 / (static_cast<double>(of) * instants); }
};

/// Whether what the Sun does not light shines: by itself or by what is not sunlight, or with normals of its
/// own.
[[nodiscard]] inline bool dark_part_shines(const BodyState& body, const Tracer& tracer) {
    return !tracer.sunlight_only() ||
           (body.built->textures != nullptr && body.built->textures->turns_normals());
}

/// Whether a part of the body's disc shines. `facets`: what is left out of the disc; may be null.
[[nodiscard]] inline bool shines(const BodyState& body, LitDisc::Part part, const LitFacets* facets,
                                 const Tracer& tracer) {
    if (facets == nullptr && (part == LitDisc::Part::lit || !body.disc.exact())) return true;
    return dark_part_shines(body, tracer);
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

/// Camera rays to points of a body, traced in packets. The light, by channel, of those that hit it goes to
/// `use(at, amount)`. `keep(hits, i)`: whether the hit of lane i on the body counts.
template<typename Keep, typename Use>
class BodyRays {
public:
    BodyRays(const BodySamples& samples, std::span<const std::int32_t> candidates, Tracer& tracer,
             const Keep& keep, const Use& use)
        : body_(samples.body), candidates_(candidates), tracer_(tracer), keep_(keep), use_(use) {
        set_all(rays_.direction, samples.row.bodies[static_cast<std::size_t>(samples.body)].direction);
        for (int i = 0; i < packet_size; ++i) {
            rays_.index.v[i] = 0;
            rays_.light_seed.v[i] = samples.seed;
        }
    }
    /// Lane that add() fills next.
    [[nodiscard]] int next_lane() const { return filled_; }
    /// Adds sample `index` along `direction` (unit, camera frame); traces full packets.
    void add(std::uint32_t index, Vec3 direction, ImagePoint at, double weight_sr) {
        rays_.direction.set(filled_, direction);
        rays_.index.v[filled_] = index;
        at_[filled_] = at;
        weight_sr_[filled_] = weight_sr;
        if (++filled_ == packet_size) trace();
    }
    /// Traces the rest.
    void finish() {
        if (filled_ > 0) trace();
    }

private:
    void trace() {
        Lanes active;
        for (int i = 0; i < packet_size; ++i)
            active.on[i] = i < filled_ ? -1 : 0;
        filled_ = 0;
        tracer_.intersect(rays_, active, candidates_);
        tracer_.count_samples(active);
        for (int i = 0; i < packet_size; ++i)
            if (rays_.hits.body[i] != body_ || !keep_(rays_.hits, i)) rays_.hits.body[i] = -1;
        tracer_.radiance({&rays_, 1});
        for (int i = 0; i < packet_size; ++i) {
            if (rays_.hits.body[i] < 0) continue;
            double amount[max_channels];
            for (std::size_t c = 0; c < tracer_.channels(); ++c)
                amount[c] = weight_sr_[i] * rays_.radiance.v[c].v[i];
            use_(at_[i], std::span<const double>(amount, tracer_.channels()));
        }
    }

    std::int32_t body_;
    std::span<const std::int32_t> candidates_;
    Tracer& tracer_;
    const Keep& keep_;
    const Use& use_;
    CameraRays rays_;
    ImagePoint at_[packet_size];
    double weight_sr_[packet_size] = {};
    int filled_ = 0;
};

/// Calls `use(index, stratum, u, v)` for every sample: the index of its random numbers, its number among the
/// samples of the instant, and a pair of numbers in [0, 1).
template<typename Use>
void for_each_pair(const BodySamples& samples, const Use& use) {
    Words index;
    Words seed;
    for (std::uint32_t& word : seed.v)
        word = samples.seed;
    for (std::uint32_t first = samples.first; first < samples.first + samples.count; first += packet_size) {
        for (std::uint32_t i = 0; i < packet_size; ++i)
            index.v[i] = samples.index(first + i);
        Doubles u;
        Doubles v;
        // Together with the points of the Sun's disc, the first pair of the samples' numbers: in a thin
        // crescent the light depends on both.
        sobol_second_pair(index, seed, u, v);
        for (int i = 0; i < packet_size; ++i)
            use(index.v[i], first + static_cast<std::uint32_t>(i), u.v[i], v.v[i]);
    }
}

/// Samples one part of a body's disc. Calls `use(at, amount)` with the image point and the light of every
/// sample that hits the body and for which `wanted(at)` was true. `candidates`: see find_occluders().
/// `facets`: those that trace_facets() samples, which are left out here; may be null.
template<typename Wanted, typename Use>
void trace_disc(const BodySamples& samples, LitDisc::Part part, const LitFacets* facets,
                const Projection& lens, std::span<const std::int32_t> candidates, Tracer& tracer,
                const Wanted& wanted, const Use& use) {
    const BodyState& body = samples.row.bodies[static_cast<std::size_t>(samples.body)];
    tracer.set_ray_width(std::sqrt(body.solid_angle_sr * samples.share()));
    const auto keep = [&](const HitPacket& hits, int i) {
        return facets == nullptr || !facets->has(hits.primitive[i]);
    };
    BodyRays rays(samples, candidates, tracer, keep, use);
    for_each_pair(samples, [&](std::uint32_t index, std::uint32_t /*stratum*/, double u, double v) {
        Vec3 direction;
        double solid_angle_sr = body.disc.sample(part, u, v, direction);
        if (!(solid_angle_sr > 0)) return;
        direction = body.to_camera(direction);
        if (body.seen.moves()) {
            // The body's frame sees another solid angle.
            const double distance = length(direction);
            direction = direction / distance;
            solid_angle_sr /= distance * distance;
        }
        const auto point = lens.project(direction);
        if (point && wanted(*point))
            rays.add(index, direction, *point,
                     solid_angle_sr * samples.share() * lens.transmission(direction));
    });
    rays.finish();
}

/// Samples the facets of a body that face both Sun and camera, as trace_disc().
template<typename Wanted, typename Use>
void trace_facets(const BodySamples& samples, const LitFacets& facets, const Projection& lens,
                  std::span<const std::int32_t> candidates, Tracer& tracer, const Wanted& wanted,
                  const Use& use) {
    if (facets.empty()) return;
    const BodyState& body = samples.row.bodies[static_cast<std::size_t>(samples.body)];
    tracer.set_ray_width(
        std::sqrt(body.solid_angle_sr * std::max(body.disc.lit_share(), 1e-3) * samples.share()));
    std::uint32_t triangle[packet_size] = {};
    double distance_m[packet_size] = {};
    // The point that was sampled, or one so near that rounding makes the difference.
    const double near_m = 1e-6 * body.shape->bounding_radius_m();
    const auto keep = [&](const HitPacket& hits, int i) {
        return hits.primitive[i] == triangle[i] || std::abs(hits.t[i] - distance_m[i]) <= near_m;
    };
    BodyRays rays(samples, candidates, tracer, keep, use);
    LitFacets::Cursor cursor;
    for_each_pair(samples, [&](std::uint32_t index, std::uint32_t stratum, double u, double v) {
        // Ascending: rays of a packet meet neighbouring facets.
        const LitFacets::Point point = facets.sample((stratum + u) / samples.of, v, cursor);
        const Vec3 to = point.position_m - body.camera_m;
        double distance = length(to);
        double solid_angle_sr = std::abs(dot(point.area_m2, to)) / (distance * distance * distance);
        Vec3 direction = transposed(body.from_camera) * (to / distance);
        if (body.seen.moves()) {
            const Vec3 there = body.to_camera(to);
            const double path = length(there);
            solid_angle_sr *= distance / path * (distance / path);
            distance = path;
            direction = there / path;
        }
        const auto at = lens.project(direction);
        if (!at || !wanted(*at)) return;
        triangle[rays.next_lane()] = point.triangle;
        distance_m[rays.next_lane()] = distance;
        rays.add(index, direction, *at, solid_angle_sr * samples.share() * lens.transmission(direction));
    });
    rays.finish();
}

} // namespace obscura::renderer
