// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/path_tracer.hpp"

#include "renderer/packets/frames.hpp"
#include "renderer/packets/lanes.hpp"
#include "renderer/shapes/stretched_rays.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::renderer {
namespace {

/// First of the pairs of random numbers for planetshine: beyond those of any bounce's own four.
constexpr std::uint32_t planetshine_pairs = 0x10000000;
/// At vertices in direct sunlight, sources below this share of the Sun's irradiance are left to chance.
constexpr double min_sunlit_ratio = 2e-3;

/// Direction of light in the frame of `source`, in that of `here`; `turn`: from here to there.
Vec3 turned_back(const BodyState& here, const BodyState& source, const Mat3& turn, Vec3 direction) {
    double stretch = 1;
    return tilts(here, source) ? relative_direction(source, here, direction, stretch)
                               : transposed(turn) * direction;
}

void copy_lanes(const Lanes& which, const SurfacePacket& from, SurfacePacket& to) {
    copy_lanes(which, from.position, to.position);
    copy_lanes(which, from.shadow_origin, to.shadow_origin);
    copy_lanes(which, from.normal, to.normal);
    copy_lanes(which, from.facet_normal, to.facet_normal);
    for (int i = 0; i < packet_size; ++i)
        to.outside.on[i] = which.on[i] != 0 ? from.outside.on[i] : to.outside.on[i];
}

} // namespace

PathTracer::PathTracer(const Instants& instants, const Lighting& lighting, const scene::Sun& sun,
                       RayCounts& counts)
    : Tracer(instants, sun, counts),
      lighting_(lighting),
      direct_light_(instants, lighting, sun, counts),
      planetshine_(std::any_of(instants.states().begin(), instants.states().end(), [](const RowState& row) {
          return std::any_of(row.bodies.begin(), row.bodies.end(),
                             [](const BodyState& body) { return body.planetshine[0].body >= 0; });
      })) {}

bool PathTracer::sunlight_only() const {
    return lighting_.max_bounces == 0 && lighting_.lamps.empty() &&
           std::all_of(row_.bodies.begin(), row_.bodies.end(),
                       [](const BodyState& body) { return body.built->emission.empty(); });
}

double PathTracer::reference_radiance(const BodyState& body) const {
    const std::vector<double>& colour = body.built->colour;
    double irradiance = 0;
    for (std::size_t c = 0; c < channels(); ++c)
        irradiance += lighting_.sun_w_m2[c] * (colour.empty() ? 1 : colour[c]);
    return body.reference_radiance * irradiance / static_cast<double>(channels());
}

void PathTracer::gather(const HitPacket& hits, PathPacket& paths, Lanes& left, PathVertex& vertex,
                        Channels* emitted) const {
    vertex.count = 0;
    vertex.body = -1;
    vertex.here = {};
    HitPacket scratch;
    const HitPacket* in_frame = &hits;
    for (int lane = 0; lane < packet_size; ++lane) {
        if (left.on[lane] == 0) continue;
        const std::int32_t index = hits.body[lane];
        const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
        if (vertex.body >= 0 && body.frame != row_.bodies[static_cast<std::size_t>(vertex.body)].frame)
            continue;
        if (vertex.body < 0) {
            vertex.body = index;
            to_body_frame(instants_, index, paths, vertex.view);
            in_frame = &hits_in_frame(vertex.view, hits, scratch);
        }
        Lanes here{};
        for (int i = lane; i < packet_size; ++i)
            if (left.on[i] != 0 && hits.body[i] == index) {
                here.on[i] = -1;
                left.on[i] = 0;
                vertex.of[i] = index;
            }
        // The first body's surface fills all lanes, so that lanes of other bodies hold finite numbers.
        SurfacePacket own;
        SurfacePacket& surface = vertex.count == 0 ? vertex.surface : own;
        body.shape->surface(vertex.view, *in_frame, index, surface);
        if (emitted != nullptr) add_emission(index, here, surface, vertex.view, *in_frame, paths, *emitted);
        if (body.material == nullptr) {
            if (vertex.count == 0) vertex.body = -1;
            continue;
        }
        vertex.varies[vertex.count] = colour(index, here, *in_frame, paths, vertex.view, surface,
                                             vertex.colour, vertex.varied[vertex.count]);
        Doubles unresolved;
        const bool rougher = body.shape->unresolved_slopes(*in_frame, index, unresolved);
        if (rougher && std::none_of(vertex.rougher, vertex.rougher + vertex.count, [](bool r) { return r; }))
            vertex.unresolved = unresolved;
        else if (rougher)
            copy_lanes(here, unresolved, vertex.unresolved);
        vertex.rougher[vertex.count] = rougher;
        for (int i = 0; i < packet_size; ++i) {
            if (here.on[i] == 0) continue;
            vertex.slot[i] = vertex.count;
            if (!lighting_.products->empty())
                vertex.chain[i] = lighting_.products->next(paths.chain[i], index);
        }
        if (vertex.count > 0) copy_lanes(here, own, vertex.surface);
        vertex.bodies[vertex.count] = index;
        vertex.on[vertex.count++] = here;
        for (int i = 0; i < packet_size; ++i)
            vertex.here.on[i] |= here.on[i];
    }
}

void PathTracer::add_emission(std::int32_t index, const Lanes& here, const SurfacePacket& surface,
                              const RayPacket& view, const HitPacket& hits, PathPacket& paths,
                              Channels& emitted) const {
    const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
    const SurfaceTextures* textures = body.built->textures.get();
    if (textures == nullptr || !textures->varies_emission()) {
        direct_light_.add_emission(body, index, here, surface, view, hits, paths, nullptr, emitted);
        return;
    }
    Doubles width_m;
    ray_widths(here, hits, paths, width_m);
    Channels factor;
    SampleTimes time;
    instants_.times(paths.instant, time);
    textures->emission(*body.shape, view, hits, index, width_m, channels(), time, surface, factor);
    direct_light_.add_emission(body, index, here, surface, view, hits, paths, &factor, emitted);
}

void PathTracer::ray_widths(const Lanes& here, const HitPacket& hits, const PathPacket& paths,
                            Doubles& width_m) const {
    for (int i = 0; i < packet_size; ++i)
        width_m[i] = here.on[i] != 0 ? (paths.travelled_m[i] + hits.t[i]) * ray_width_rad_ : 0.0;
}

bool PathTracer::colour(std::int32_t index, const Lanes& here, const HitPacket& hits, const PathPacket& paths,
                        const RayPacket& view, SurfacePacket& surface, Channels& factor,
                        ParameterPacket& varied) const {
    const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
    const BuiltBody& built = *body.built;
    const std::size_t channels = lighting_.sun_w_m2.size();
    if (!built.textures) {
        for (std::size_t c = 0; c < channels; ++c) {
            const double value = built.colour.empty() ? 1.0 : built.colour[c];
            for (int i = 0; i < packet_size; ++i)
                factor.v[c][i] = here.on[i] != 0 ? value : factor.v[c][i];
        }
        return false;
    }
    Doubles width_m;
    ray_widths(here, hits, paths, width_m);
    Channels textured;
    SampleTimes time;
    instants_.times(paths.instant, time);
    built.textures->apply(*body.shape, view, hits, index, width_m, channels, time, surface, textured, varied);
    for (std::size_t c = 0; c < channels; ++c) {
        const double value = built.colour.empty() ? 1.0 : built.colour[c];
        for (int i = 0; i < packet_size; ++i)
            factor.v[c][i] = here.on[i] != 0 ? textured.v[c][i] * value : factor.v[c][i];
    }
    return built.textures->varies();
}

bool PathTracer::sunlight_weights(const PathVertex& vertex, const PathPacket& paths, Doubles& weight) const {
    bool any = false;
    for (int i = 0; i < packet_size; ++i) {
        weight[i] = 1;
        if (vertex.here.on[i] == 0 || paths.shone_on[i] < 0 || paths.pdf[i] == delta_pdf) continue;
        const auto& sources = instants_.body(paths.shone_on[i], paths.instant, i).planetshine;
        if (std::none_of(sources.begin(), sources.end(),
                         [&](const PlanetshineSource& s) { return s.body == vertex.of[i]; }))
            continue;
        const BodyState& source = instants_.body(vertex.of[i], paths.instant, i);
        const LitDisc disc(*source.shape, vertex.view.origin.lane(i), source.sun_m, sun_.radius_m);
        const double inverse_pdf = disc.inverse_pdf_sr(LitDisc::Part::lit, vertex.view.direction.lane(i));
        if (!(inverse_pdf > 0)) continue;
        // Compute the MIS weight: balance heuristic, pdfs per steradian.
        weight[i] = paths.pdf[i] / (paths.pdf[i] + 1 / inverse_pdf);
        any = true;
    }
    return any;
}

void PathTracer::choose_shone_on(const PathVertex& vertex, const Channels& out, PathPacket& paths) const {
    for (int i = 0; i < packet_size; ++i) {
        if (vertex.here.on[i] == 0) continue;
        double light = 0;
        for (std::size_t c = 0; c < channels(); ++c)
            light = std::max(light, out.v[c][i]);
        const PlanetshineSource brightest = planetshine_source(vertex, paths, i, 0);
        const bool matters = light > 0 ? brightest.ratio > min_sunlit_ratio : brightest.body >= 0;
        paths.shone_on[i] = matters ? vertex.of[i] : -1;
    }
}

void PathTracer::sample_planetshine(const PathVertex& vertex, const PathPacket& paths, std::size_t slot,
                                    const Lanes& active, const Doubles& u, const Doubles& v, Vec3s& light,
                                    Doubles& inverse_pdf) const {
    Mat3 turn;
    Vec3 offset;
    std::int32_t turned_to = -1;
    for (int i = 0; i < packet_size; ++i) {
        light.set(i, {0, 0, 1});
        inverse_pdf[i] = 0;
        if (active.on[i] == 0) continue;
        const std::int32_t index = planetshine_source(vertex, paths, i, slot).body;
        const BodyState& source = instants_.body(index, paths.instant, i);
        const BodyState& here = instants_.body(vertex.body, paths.instant, i);
        if (turned_to != index || !instants_.one() || tilts(here, source)) {
            turn = relative_rotation(here, source);
            offset = relative_origin(here, source, paths.path_m(i));
            turned_to = index;
        }
        const LitDisc disc(*source.shape, turn * vertex.surface.shadow_origin.lane(i) + offset, source.sun_m,
                           sun_.radius_m);
        Vec3 direction;
        inverse_pdf[i] = disc.sample(LitDisc::Part::lit, u[i], v[i], direction);
        if (inverse_pdf[i] > 0) light.set(i, turned_back(here, source, turn, direction));
    }
}

void PathTracer::aim_at_planetshine(const PathVertex& vertex, const PathPacket& paths, const Lanes& active,
                                    const Vec3s& light, const Doubles& inverse_pdf, PathPacket& probe) const {
    Scattered scattered;
    evaluate_brdf(row_, vertex, channels(), light, scattered);
    const Doubles& r = scattered.r;
    probe.instant = paths.instant;
    if (terrain_) probe.level_u = paths.level_u;
    instants_.to_inertial(vertex.body, probe.instant, vertex.surface.shadow_origin, probe.origin);
    instants_.directions_to_inertial(vertex.body, probe.instant, light, probe.direction);
    for (int i = 0; i < packet_size; ++i) {
        probe.start.set(i, instants_.body(vertex.body, probe.instant, i).seen.position_at(paths.path_m(i)));
        const bool open = dot(light.lane(i), vertex.surface.facet_normal.lane(i)) > 0;
        probe.alive.on[i] = active.on[i] != 0 && open && r[i] * inverse_pdf[i] > 0 ? -1 : 0;
        double value = 0;
        if (probe.alive.on[i] != 0) {
            // Compute the MIS weight against BSDF sampling.
            const double pdf = 1 / inverse_pdf[i];
            value = r[i] * inverse_pdf[i] * pdf / (pdf + sample_bsdf_pdf(row_, vertex, i, light.lane(i)));
        }
        for (std::size_t c = 0; c < channels(); ++c)
            probe.throughput.v[c][i] = paths.throughput.v[c][i] * scattered.colour->v[c][i] * value;
        probe.travelled_m[i] = paths.path_m(i);
        probe.chain[i] = vertex.chain[i];
    }
}

void PathTracer::add_planetshine(std::uint32_t bounce, const PathVertex& vertex, PathPacket& paths,
                                 Channels& out) {
    choose_shone_on(vertex, out, paths);
    for (std::size_t slot = 0; slot < max_planetshine_sources; ++slot) {
        Lanes active{};
        for (int i = 0; i < packet_size; ++i)
            active.on[i] = vertex.here.on[i] != 0 && paths.shone_on[i] >= 0 &&
                                   planetshine_source(vertex, paths, i, slot).body >= 0
                               ? -1
                               : 0;
        if (!active.any()) return;
        SampleStream random(paths.index, paths.seed,
                            planetshine_pairs +
                                2 * (max_planetshine_sources * bounce + static_cast<std::uint32_t>(slot)));
        Doubles u;
        Doubles v;
        Doubles sun_u;
        Doubles sun_v;
        random.next(u, v);
        random.next(sun_u, sun_v);
        Vec3s light;
        Doubles inverse_pdf;
        sample_planetshine(vertex, paths, slot, active, u, v, light, inverse_pdf);
        PathPacket probe;
        aim_at_planetshine(vertex, paths, active, light, inverse_pdf, probe);
        if (!probe.alive.any()) continue;
        // Trace the rays, which must hit the source, and add the direct sunlight there.
        follow(probe);
        for (int i = 0; i < packet_size; ++i)
            if (probe.alive.on[i] != 0 &&
                probe.hits.body[i] != planetshine_source(vertex, paths, i, slot).body)
                probe.alive.on[i] = 0;
        PathVertex lit;
        lit.coherent = false;
        for (std::size_t c = 0; c < channels(); ++c)
            for (double& value : lit.colour.v[c].v)
                value = 0;
        Lanes left = probe.alive;
        while (left.any()) {
            gather(probe.hits, probe, left, lit, nullptr);
            if (lit.count > 0) direct_light_.add_sun(lit, sun_u, sun_v, probe, nullptr, out);
        }
    }
}

void PathTracer::shade(std::uint32_t bounce, PathPacket& paths, Channels& out) {
    const std::size_t channels = lighting_.sun_w_m2.size();
    // Draw random numbers: each bounce has four pairs of its own, used or not.
    SampleStream random(paths.index, paths.seed, 4 * bounce);
    Doubles sun_u;
    Doubles sun_v;
    Doubles area_u;
    Doubles area_v;
    Doubles bsdf_u;
    Doubles bsdf_v;
    const bool last = bounce >= lighting_.max_bounces;
    const bool sun = lighting_.has_sun();
    const bool area = !lighting_.area_lights.empty();
    if (sun)
        random.next(sun_u, sun_v);
    else
        random.skip();
    if (area)
        random.next(area_u, area_v);
    else
        random.skip();
    if (!last) random.next(bsdf_u, bsdf_v);

    PathVertex vertex;
    vertex.coherent = bounce == 0;
    for (std::size_t c = 0; c < channels; ++c)
        for (int i = 0; i < packet_size; ++i)
            vertex.colour.v[c][i] = 0;
    Lanes left = paths.alive;
    while (left.any()) {
        gather(paths.hits, paths, left, vertex, &out);
        if (vertex.count == 0) continue;
        // Sample lights.
        if (sun) {
            Doubles weight;
            const bool weighted = planetshine_ && bounce > 0 && sunlight_weights(vertex, paths, weight);
            direct_light_.add_sun(vertex, sun_u, sun_v, paths, weighted ? &weight : nullptr, out);
        }
        direct_light_.add_lamps(vertex, paths, out);
        if (area) direct_light_.add_area_light(vertex, area_u, area_v, paths, !last, out);
        if (sun && planetshine_ && !last) add_planetshine(bounce, vertex, paths, out);
        // Sample the next direction.
        if (!last) sample_bsdf(instants_, vertex, bsdf_u, bsdf_v, channels, paths);
    }
    if (last) return;
    // Russian roulette.
    Doubles roulette_u;
    Doubles unused;
    random.next(roulette_u, unused);
    for (int i = 0; i < packet_size; ++i) {
        if (paths.alive.on[i] == 0) continue;
        double most = 0;
        bool lit = bounce > 0;
        for (std::size_t c = 0; c < channels; ++c) {
            most = std::max(most, paths.throughput.v[c][i] * paths.expectation[i]);
            lit = lit || out.v[c][i] > 0;
        }
        if (!lit) continue;
        const double survival = std::clamp(std::sqrt(most), 0.05, 1.0);
        if (roulette_u[i] >= survival) paths.alive.on[i] = 0;
        for (std::size_t c = 0; c < channels; ++c)
            paths.throughput.v[c][i] /= survival;
    }
}

void PathTracer::follow(PathPacket& paths) {
    HitPacket& hits = paths.hits;
    hits.clear();
    counts_.rays += static_cast<std::uint64_t>(paths.alive.count());
    RayPacket rays;
    rays.active = paths.alive;
    rays.coherent = false;
    for (double& t : rays.t_max.v)
        t = no_hit;
    if (terrain_) rays.level_u = paths.level_u;
    std::int32_t frame = -1;
    for (std::size_t b = 0; b < row_.bodies.size(); ++b) {
        const BodyState& body = row_.bodies[b];
        const auto index = static_cast<std::int32_t>(b);
        if (body.frame != frame) to_body_frame(instants_, index, paths, rays);
        frame = body.frame;
        rays.detail = body.detail_view();
        intersect_stretched(*body.shape, rays, index, hits);
    }
    for (int i = 0; i < packet_size; ++i)
        if (hits.body[i] < 0) paths.alive.on[i] = 0;
}

void PathTracer::radiance(std::span<CameraRays> batch) {
    const std::size_t channels = lighting_.sun_w_m2.size();
    // Begin one path for each camera ray.
    std::array<PathPacket, batch_size> all;
    for (std::size_t k = 0; k < batch.size(); ++k) {
        CameraRays& rays = batch[k];
        PathPacket& paths = all[k];
        for (std::size_t c = 0; c < channels; ++c)
            for (int i = 0; i < packet_size; ++i) {
                rays.radiance.v[c][i] = 0;
                paths.throughput.v[c][i] = 1;
            }
        if (instants_.one()) {
            transform(row_.inertial_from_camera, rays.direction, {}, paths.direction);
            set_all(paths.start, row_.camera.position_m);
        } else {
            for (int i = 0; i < packet_size; ++i) {
                const RowState& row = instants_.at(rays.instant, i);
                paths.direction.set(i, row.inertial_from_camera * rays.direction.lane(i));
                paths.start.set(i, row.camera.position_m);
            }
        }
        set_all(paths.origin, {});
        paths.hits = rays.hits;
        paths.index = rays.index;
        paths.seed = rays.light_seed;
        paths.instant = rays.instant;
        if (terrain_) paths.level_u = rays.level_u;
        for (int i = 0; i < packet_size; ++i) {
            paths.alive.on[i] = rays.hits.body[i] >= 0 ? -1 : 0;
            paths.pdf[i] = delta_pdf;
            paths.travelled_m[i] = 0;
            paths.shone_on[i] = -1;
            paths.chain[i] = ColourProducts::none;
            paths.owner[i] = static_cast<std::int32_t>(k) * packet_size + i;
        }
    }
    std::span<PathPacket> left = std::span(all).first(batch.size());
    for (std::uint32_t bounce = 0; !left.empty(); ++bounce) {
        // Shade the hits and add their light to the camera rays.
        for (PathPacket& paths : left) {
            if (!paths.alive.any()) continue;
            Channels light;
            for (std::size_t c = 0; c < channels; ++c)
                for (double& value : light.v[c].v)
                    value = 0;
            const Lanes lit = paths.alive;
            shade(bounce, paths, light);
            for (int i = 0; i < packet_size; ++i) {
                if (lit.on[i] == 0) continue;
                Channels& out = batch[static_cast<std::size_t>(paths.owner[i] / packet_size)].radiance;
                for (std::size_t c = 0; c < channels; ++c)
                    out.v[c][paths.owner[i] % packet_size] += light.v[c][i];
            }
        }
        if (bounce >= lighting_.max_bounces) return;
        // Compact the surviving paths and trace their next rays.
        left = left.first(compact(left, channels));
        for (PathPacket& paths : left)
            follow(paths);
    }
}

} // namespace obscura::renderer
