// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/tracer.hpp"

#include "renderer/integrators/rough_ground.hpp"
#include "renderer/lights/sunlight.hpp"
#include "renderer/shapes/stretched_rays.hpp"

#include <algorithm>

namespace obscura::renderer {
namespace {

/// Pair of a sample's stream that its level of detail is chosen by; far from all pairs of paths.
constexpr std::uint32_t level_pair = 0x40000000;

} // namespace

OBSCURA_VECTOR_CLONES
void scatter_angles(const SurfacePacket& surface, const Vec3s& view, const Vec3s& light, ScatterPacket& s) {
    for (int i = 0; i < packet_size; ++i) {
        const double nx = surface.normal.x.v[i];
        const double ny = surface.normal.y.v[i];
        const double nz = surface.normal.z.v[i];
        const double out = -(nx * view.x.v[i] + ny * view.y.v[i] + nz * view.z.v[i]);
        s.cos_in.v[i] = nx * light.x.v[i] + ny * light.y.v[i] + nz * light.z.v[i];
        // Interpolated normals may turn away from the viewer at the limb.
        s.cos_out.v[i] = out > 1e-6 ? out : 1e-6;
        s.cos_phase.v[i] =
            -(view.x.v[i] * light.x.v[i] + view.y.v[i] * light.y.v[i] + view.z.v[i] * light.z.v[i]);
    }
}

Tracer::Tracer(const Instants& instants, const scene::Sun& sun, RayCounts& counts)
    : instants_(instants),
      row_(instants_.front()),
      sun_(sun),
      sun_radiance_(sun_radiance_per_irradiance(sun.radius_m)),
      counts_(counts),
      terrain_(std::any_of(row_.bodies.begin(), row_.bodies.end(),
                           [](const BodyState& body) { return body.detail.cell_rad > 0; })) {}

void Tracer::intersect(const Vec3s& direction, const Lanes& active, std::span<const std::int32_t> candidates,
                       HitPacket& hits, const Words& instant) {
    intersect(direction, active, candidates, hits, instant, nullptr);
}

void Tracer::intersect(CameraRays& rays, const Lanes& active, std::span<const std::int32_t> candidates) {
    if (terrain_) {
        Doubles unused;
        SampleStream(rays.index, rays.light_seed, level_pair).next(rays.level_u, unused);
    }
    intersect(rays.direction, active, candidates, rays.hits, rays.instant, &rays.level_u);
}

void Tracer::intersect(const Vec3s& direction, const Lanes& active, std::span<const std::int32_t> candidates,
                       HitPacket& hits, const Words& instant, const Doubles* level_u) {
    hits.clear();
    counts_.rays += static_cast<std::uint64_t>(active.count());
    RayPacket rays;
    rays.active = active;
    for (double& t : rays.t_max.v)
        t = no_hit;
    if (terrain_)
        for (int i = 0; i < packet_size; ++i)
            rays.level_u[i] = level_u != nullptr ? (*level_u)[i] : 0.5;
    for (const std::int32_t index : candidates) {
        instants_.from_camera(index, instant, direction, rays);
        rays.sunlight_only = level_u != nullptr && sunlight_only();
        intersect_stretched(*row_.bodies[static_cast<std::size_t>(index)].shape, rays, index, hits);
    }
}

void Tracer::radiance(std::span<CameraRays> batch) {
    for (CameraRays& rays : batch) {
        Doubles& radiance = rays.radiance.v[0];
        Doubles u;
        Doubles v;
        SampleStream(rays.index, rays.light_seed).next(u, v);
        for (double& r : radiance.v)
            r = 0;
        // Shade body by body; most packets hit only one.
        const HitPacket& hits = rays.hits;
        Lanes left;
        for (int i = 0; i < packet_size; ++i)
            left.on[i] = hits.body[i] >= 0 ? -1 : 0;
        for (int i = 0; i < packet_size; ++i) {
            if (left.on[i] == 0) continue;
            const std::int32_t body = hits.body[i];
            reflect(body, rays, u, v, radiance);
            for (int k = i; k < packet_size; ++k)
                left.on[k] = hits.body[k] == body ? 0 : left.on[k];
        }
    }
}

void Tracer::reflect(std::int32_t index, const CameraRays& rays, const Doubles& u, const Doubles& v,
                     Doubles& radiance) {
    const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
    RayPacket view;
    instants_.from_camera(index, rays.instant, rays.direction, view);
    HitPacket scratch;
    const HitPacket& hits = hits_in_frame(view, rays.hits, scratch);
    Lanes left;
    for (int i = 0; i < packet_size; ++i)
        left.on[i] = hits.body[i] == index ? -1 : 0;
    if (terrain_ && body.material != nullptr) {
        reflect_kept(index, rays, view, u, v, left, radiance);
        if (!left.any()) return;
    }
    SurfacePacket surface;
    body.shape->surface(view, hits, index, surface);
    if (body.material == nullptr) {
        for (int i = 0; i < packet_size; ++i)
            if (hits.body[i] == index)
                radiance.v[i] =
                    sun_radiance_ *
                    limb_factor(sun_.limb_darkening, -dot(surface.normal.lane(i), view.direction.lane(i)));
        return;
    }

    // Evaluate textures.
    Channels factor;
    ParameterPacket varied;
    if (body.built->textures) {
        Doubles width_m;
        for (int i = 0; i < packet_size; ++i)
            width_m[i] = hits.body[i] == index ? hits.t[i] * ray_width_rad_ : 0.0;
        SampleTimes time;
        instants_.times(rays.instant, time);
        body.built->textures->apply(*body.shape, view, hits, index, width_m, 1, time, surface, factor,
                                    varied);
    }
    // Sample the Sun's disc.
    RayPacket shadow;
    Doubles solid_angle;
    instants_.sample_sun(index, rays.instant, surface.position, sun_, u, v, shadow.direction, solid_angle);
    // Evaluate the BRDF.
    const bool varies = body.built->textures && body.built->textures->varies();
    Doubles r, unresolved;
    const bool rougher = body.shape->unresolved_slopes(hits, index, unresolved);
    ground_reflectance(*body.material, surface, view.direction, shadow.direction, varies ? &varied : nullptr,
                       rougher ? &unresolved : nullptr, r);
    if (body.built->textures)
        for (int i = 0; i < packet_size; ++i)
            r[i] *= factor.v[0][i];

    // Trace shadow rays.
    for (int i = 0; i < packet_size; ++i) {
        // Bodies are opaque: no light reaches a surface seen from inside.
        const bool open = surface.outside.on[i] != 0 || body.shape->shadows_itself();
        shadow.active.on[i] = left.on[i] != 0 && r.v[i] > 0 && open ? -1 : 0;
        // No occluder lies beyond the Sun.
        shadow.t_max.v[i] = no_hit;
    }
    if (terrain_) shadow.level_u = rays.level_u;
    if (body.shape->shadows_itself() && shadow.active.any()) {
        counts_.rays += static_cast<std::uint64_t>(shadow.active.count());
        shadow.origin = surface.shadow_origin;
        shadow.detail = body.detail_view();
        body.shape->occlude(shadow);
    }
    for (const std::int32_t other : body.occluders)
        occlude_by(index, other, rays.instant, surface.shadow_origin, rays.hits.t, shadow);
    for (int i = 0; i < packet_size; ++i)
        if (shadow.active.on[i] != 0) radiance.v[i] = r.v[i] * sun_radiance_ * solid_angle.v[i];
}

void Tracer::reflect_kept(std::int32_t index, const CameraRays& rays, const RayPacket& view, const Doubles& u,
                          const Doubles& v, Lanes& left, Doubles& radiance) {
    const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
    Doubles width_m;
    for (int i = 0; i < packet_size; ++i)
        width_m[i] = left.on[i] != 0 ? rays.hits.t[i] * ray_width_rad_ : 0.0;
    SunlitPacket lit;
    HitPacket scratch;
    const HitPacket& hits = hits_in_frame(view, rays.hits, scratch);
    if (!body.shape->sunlit(view, hits, index, width_m, lit)) return;
    bool dark = true;
    for (int i = 0; i < packet_size; ++i)
        dark = dark && (left.on[i] == 0 || (lit.known.on[i] != 0 && !(lit.visible[i] > 0)));
    if (dark) {
        left = {};
        return;
    }
    SurfacePacket surface;
    surface.position = surface.shadow_origin = lit.position;
    surface.normal = surface.facet_normal = lit.normal;
    surface.outside = left;
    // Light from the middle of the disc: its width is in the visibility.
    RayPacket shadow;
    Doubles solid_angle;
    scene::Sun even;
    even.radius_m = sun_.radius_m;
    const Doubles middle{};
    instants_.sample_sun(index, rays.instant, surface.position, even, middle, middle, shadow.direction,
                         solid_angle);
    Channels factor;
    ParameterPacket varied;
    const SurfaceTextures* const textures = body.built->textures.get();
    if (textures != nullptr) {
        SurfacePacket turned = surface; // the means stay
        SampleTimes time;
        instants_.times(rays.instant, time);
        textures->apply(*body.shape, view, hits, index, width_m, 1, time, turned, factor, varied);
    }
    Doubles r, unresolved;
    const bool rougher = body.shape->unresolved_slopes(hits, index, unresolved);
    ground_reflectance(*body.material, surface, view.direction, shadow.direction,
                       textures != nullptr && textures->varies() ? &varied : nullptr,
                       rougher ? &unresolved : nullptr, r);
    for (int i = 0; i < packet_size; ++i) {
        if (left.on[i] == 0 || lit.known.on[i] == 0) {
            shadow.active.on[i] = 0;
            continue;
        }
        left.on[i] = 0;
        r[i] *= lit.visible[i] * (textures != nullptr ? factor.v[0][i] : 1);
        shadow.active.on[i] = r[i] > 0 ? -1 : 0;
        shadow.t_max[i] = no_hit;
    }
    if (!body.occluders.empty() && shadow.active.any()) {
        Doubles unused;
        shadow.level_u = rays.level_u;
        instants_.sample_sun(index, rays.instant, surface.position, even, u, v, shadow.direction, unused);
        for (const std::int32_t occluder : body.occluders)
            occlude_by(index, occluder, rays.instant, surface.shadow_origin, rays.hits.t, shadow);
    }
    for (int i = 0; i < packet_size; ++i)
        if (shadow.active.on[i] != 0) radiance.v[i] = r[i] * sun_radiance_ * solid_angle[i];
}

void Tracer::occlude_by(std::int32_t body, std::int32_t other, const Words& instant, const Vec3s& origin,
                        const Doubles& path_m, RayPacket& rays) {
    if (!rays.active.any()) return;
    counts_.rays += static_cast<std::uint64_t>(rays.active.count());
    RayPacket moved;
    instants_.between(body, other, instant, origin, rays.direction, path_m, moved);
    moved.t_max = rays.t_max;
    stretch_limits(moved);
    moved.active = rays.active;
    moved.coherent = rays.coherent;
    if (terrain_) moved.level_u = rays.level_u;
    row_.bodies[static_cast<std::size_t>(other)].shape->occlude(moved);
    rays.active = moved.active;
}

} // namespace obscura::renderer
