// SPDX-License-Identifier: Apache-2.0
#include "renderer/received/exchange.hpp"

#include "renderer/lights/sunlight.hpp"
#include "renderer/materials/hemisphere.hpp"

#include <oneapi/tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <numbers>
#include <numeric>

namespace obscura::renderer {
namespace {

/// Cosine-weighted directions about normals from two random numbers each.
void directions_about(const Vec3s& normal, const Doubles& u, const Doubles& v, Vec3s& direction) {
    for (int i = 0; i < packet_size; ++i)
        direction.set(i, around(normal.lane(i), std::sqrt(1 - u[i]), v[i]));
}

/// Traces what one body sees.
class ExchangeTracer {
public:
    ExchangeTracer(const PatchRays& rays, const PatchBody& body, std::uint32_t directions,
                   std::uint32_t far_directions, std::uint64_t seed, BodyExchange& out)
        : rays_(rays), body_(body), seed_(seed), each_(far_directions), out_(out) {
        const std::size_t patches = body.receivers->patches().size();
        const BodyState& own = rays.state(body);
        bool near = own.shape->shadows_itself();
        for (const PatchBody& other : rays.scene().bodies) {
            if (other.index == body.index) continue;
            if (!far_away(own, rays.state(other)))
                near = true;
            else if (!negligible(own, rays.state(other)))
                far_.push_back(other.index);
        }
        if (near && directions > 0) {
            out.directions = directions;
            out.near.assign(patches * directions, PatchHit::none);
        }
        out.far_directions = far_.size() * far_directions;
        out.far.assign(patches * out.far_directions, {PatchHit::none, 0});
    }

    bool run(const std::function<bool(std::size_t)>& done) {
        std::atomic<std::size_t> count{0};
        std::atomic<std::uint64_t> traced{0}, inner{0};
        std::atomic<bool> stopped{false};
        tbb::parallel_for(std::size_t{0}, body_.receivers->packets(), [&](std::size_t p) {
            if (stopped.load(std::memory_order_relaxed)) return;
            Counts counts;
            Words near, far;
            body_.receivers->seeds(p, seed_, Receivers::Draw::near, near);
            body_.receivers->seeds(p, seed_, Receivers::Draw::far, far);
            for (std::uint32_t k = 0; k < out_.directions; ++k)
                trace_near(p, near, k, counts);
            for (std::size_t f = 0; f < far_.size(); ++f)
                for (std::uint32_t k = 0; k < each_; ++k)
                    trace_far(p, far, f, k, counts);
            traced += counts.rays;
            inner += counts.inner;
            if (!done(count.fetch_add(1) + 1)) stopped = true;
        });
        out_.rays = traced;
        out_.inner_hits = inner;
        return !stopped;
    }

private:
    /// Whether a body far away fills so little of the sky that its light is nothing beside other light.
    static bool negligible(const BodyState& body, const BodyState& other) {
        constexpr double least = 1e-10; // irradiance per radiosity
        const double sine =
            other.shape->bounding_radius_m() / length(other.seen.position_at(0) - body.seen.position_at(0));
        return sine * sine < least;
    }

    struct Counts {
        std::uint64_t rays = 0, inner = 0;
    };

    /// Whether `other` is seen as a disc from everywhere on `body`.
    static bool far_away(const BodyState& body, const BodyState& other) {
        constexpr double clearance = 1.5; // of its radius: the disc is then no wider than 84 degrees
        const double distance = length(other.seen.position_at(0) - body.seen.position_at(0));
        return distance > body.shape->bounding_radius_m() + clearance * other.shape->bounding_radius_m();
    }

    void trace_near(std::size_t packet, const Words& seeds, std::uint32_t k, Counts& counts) {
        PatchPoints at;
        Doubles random[4];
        draw(seeds, 0, k, random);
        body_.receivers->points(packet, random[0], random[1], out_.directions, at);
        RayPacket rays;
        rays.origin = at.surface.shadow_origin;
        directions_about(at.surface.facet_normal, random[2], random[3], rays.direction);
        std::fill_n(rays.t_max.v, packet_size, no_hit);
        std::fill_n(rays.level_u.v, packet_size, 0.5);
        rays.coherent = false;
        rays.active = {};
        for (std::size_t i = 0; i < at.count; ++i)
            rays.active.on[i] = at.area_m2.v[i] > 0 ? -1 : 0;
        counts.rays += static_cast<std::uint64_t>(rays.active.count());
        HitPacket hits;
        rays_.nearest(body_.index, rays, hits);
        PatchHit found[packet_size];
        rays_.patches(body_.index, rays, hits, found);
        for (std::size_t i = 0; i < at.count; ++i) {
            if (found[i].patch == PatchHit::none) continue;
            counts.inner += found[i].patch == PatchHit::inner_side ? 1 : 0;
            // Bodies far away are seen by directions of their own.
            const bool far = std::find(far_.begin(), far_.end(), hits.body[i]) != far_.end();
            if (far || found[i].patch == PatchHit::inner_side) continue;
            out_.near[at.patch[i] * out_.directions + k] = found[i].patch;
        }
    }

    void trace_far(std::size_t packet, const Words& seeds, std::size_t f, std::uint32_t k, Counts& counts) {
        const std::int32_t other = far_[f];
        PatchPoints at;
        Doubles random[4], solid_angle;
        draw(seeds, static_cast<std::uint32_t>(f), k, random);
        body_.receivers->points(packet, random[0], random[1], each_, at);
        const BodyState& own = rays_.state(body_);
        const BodyState& seen = rays_.row().bodies[static_cast<std::size_t>(other)];
        scene::Sun disc; // of the bounding sphere: directions uniform in solid angle
        disc.radius_m = seen.shape->bounding_radius_m();
        RayPacket rays;
        sample_sun(at.surface.position,
                   own.from_inertial * (seen.seen.position_at(0) - own.seen.position_at(0)), disc, random[2],
                   random[3], rays.direction, solid_angle);
        rays.origin = at.surface.shadow_origin;
        std::fill_n(rays.t_max.v, packet_size, no_hit);
        std::fill_n(rays.level_u.v, packet_size, 0.5);
        rays.coherent = false;
        rays.active = {};
        Doubles weight;
        for (std::size_t i = 0; i < packet_size; ++i) {
            const auto lane = static_cast<int>(i);
            const double cosine = dot(at.surface.facet_normal.lane(lane), rays.direction.lane(lane));
            weight[lane] = cosine * solid_angle[lane] / (std::numbers::pi * each_);
            rays.active.on[i] = i < at.count && at.area_m2[lane] > 0 && cosine > 0 ? -1 : 0;
        }
        if (!rays.active.any()) return;
        counts.rays += static_cast<std::uint64_t>(rays.active.count());
        HitPacket hits;
        rays_.nearest(body_.index, rays, hits);
        PatchHit found[packet_size];
        rays_.patches(body_.index, rays, hits, found);
        for (std::size_t i = 0; i < at.count; ++i)
            if (found[i].patch < PatchHit::inner_side && hits.body[i] == other)
                out_.far[at.patch[i] * out_.far_directions + f * each_ + k] = {
                    found[i].patch, static_cast<float>(weight.v[i])};
    }

    const PatchRays& rays_;
    const PatchBody& body_;
    const std::uint64_t seed_;
    const std::uint32_t each_;
    BodyExchange& out_;
    std::vector<std::int32_t> far_;
};

} // namespace

BodyExchange trace_exchange(const PatchRays& rays, const PatchBody& body, std::uint32_t directions,
                            std::uint32_t far_directions, std::uint64_t seed,
                            const std::function<bool(std::size_t)>& done) {
    BodyExchange out;
    ExchangeTracer(rays, body, directions, far_directions, seed, out).run(done);
    return out;
}

void near_directions(const Words& seeds, std::uint32_t k, const Vec3s& normal, Vec3s& direction) {
    Doubles random[4];
    draw(seeds, 0, k, random);
    directions_about(normal, random[2], random[3], direction);
}

} // namespace obscura::renderer
