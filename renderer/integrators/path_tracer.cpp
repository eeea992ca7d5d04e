// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/path_tracer.hpp"

#include "renderer/lights/sunlight.hpp"
#include "renderer/packets/frames.hpp"
#include "renderer/world/motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace obscura::renderer {

/// pdf of directions that area sampling cannot find: the camera's own rays and mirrored ones (a delta
/// distribution). Emission that they meet has MIS weight 1.
constexpr double delta_pdf = no_hit;

/// 16 paths: current ray, throughput and random numbers.
struct PathTracer::Paths {
    Vec3s origin;    ///< inertial axes, relative to `start`
    Vec3s direction; ///< inertial axes
    Vec3s start;     ///< position of the body that the path left, or of the camera; inertial
    Lanes alive;
    Channels throughput;
    Doubles pdf;         ///< of `direction` by BSDF sampling, 1/sr; or delta_pdf
    Doubles travelled_m; ///< path length from the camera
    HitPacket hits;      ///< nearest surfaces along the rays
    Words index, seed;   ///< of their random numbers, see SampleStream
    /// The camera ray that the path began with: packet of the batch times packet_size plus lane.
    std::int32_t owner[packet_size];
};

/// Path vertices on bodies that share a frame; everything in that frame.
struct PathTracer::Vertex {
    const BodyState* body = nullptr;  ///< any body of the frame
    Lanes here;                       ///< the lanes that scatter light
    std::int32_t of[packet_size];     ///< index of each lane's body in the row
    std::int32_t bodies[packet_size]; ///< the bodies that were hit, `count` of them
    Lanes on[packet_size];            ///< the lanes on each of `bodies`
    int count = 0;
    bool coherent = true; ///< reached by camera rays
    RayPacket view;
    SurfacePacket surface;
    Channels colour;                     ///< factor on the material's reflectance
    bool varies[packet_size];            ///< whether the parameters of each of `bodies` differ by lane
    ParameterPacket varied[packet_size]; ///< the parameters of those that do
    std::int32_t slot[packet_size];      ///< index of each lane's body in `bodies`

    /// Material parameters of one lane; null: the material's constants.
    [[nodiscard]] const ParameterPacket* varied_at(int lane) const {
        return varies[slot[lane]] ? &varied[slot[lane]] : nullptr;
    }
};

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

/// Copies the lanes that are on in `which`.
OBSCURA_VECTOR_CLONES
void take(const Lanes& which, const Doubles& from, Doubles& to) {
    for (int i = 0; i < packet_size; ++i)
        to.v[i] = which.on[i] != 0 ? from.v[i] : to.v[i];
}
void take(const Lanes& which, const Vec3s& from, Vec3s& to) {
    take(which, from.x, to.x);
    take(which, from.y, to.y);
    take(which, from.z, to.z);
}
void take(const Lanes& which, const SurfacePacket& from, SurfacePacket& to) {
    take(which, from.position, to.position);
    take(which, from.shadow_origin, to.shadow_origin);
    take(which, from.normal, to.normal);
    take(which, from.facet_normal, to.facet_normal);
    for (int i = 0; i < packet_size; ++i)
        to.outside.on[i] = which.on[i] != 0 ? from.outside.on[i] : to.outside.on[i];
}

/// out += throughput * colour * light * scale, lane by lane.
OBSCURA_VECTOR_CLONES
void add_light(const Doubles& throughput, const Doubles& colour, const Doubles& light, double scale,
               Doubles& out) {
    for (int i = 0; i < packet_size; ++i)
        out.v[i] += throughput.v[i] * light.v[i] * (colour.v[i] * scale);
}

} // namespace

PathTracer::PathTracer(const RowState& row, const Lighting& lighting, const scene::Sun& sun,
                       RayCounts& counts)
    : Tracer(row, sun, counts), lighting_(lighting) {}

void PathTracer::rays_in(const BodyState& body, const Paths& paths, RayPacket& rays) const {
    turn_rays(body.from_inertial, paths.origin, paths.start, body.position_m, paths.direction, rays);
}

void PathTracer::block(const Vertex& vertex, bool all_bodies, RayPacket& light) {
    light.origin = vertex.surface.shadow_origin;
    light.coherent = vertex.coherent;
    RayPacket turned; // in the frame `turned_to`
    turned.coherent = vertex.coherent;
    std::int32_t turned_to = -1;
    for (std::size_t b = 0; b < row_.bodies.size(); ++b) {
        const BodyState& other = row_.bodies[b];
        if (other.material == nullptr) continue;
        const auto index = static_cast<std::int32_t>(b);
        Lanes asked{};
        for (int k = 0; k < vertex.count; ++k) {
            const BodyState& own = row_.bodies[static_cast<std::size_t>(vertex.bodies[k])];
            if (vertex.bodies[k] != index && !all_bodies &&
                !std::binary_search(own.occluders.begin(), own.occluders.end(), index))
                continue;
            // A convex body never shades its own outside, always its inside.
            const bool inside_only = vertex.bodies[k] == index && !own.shape->shadows_itself();
            for (int i = 0; i < packet_size; ++i)
                asked.on[i] |= vertex.on[k].on[i] & light.active.on[i] &
                               (inside_only ? ~vertex.surface.outside.on[i] : -1);
        }
        if (!asked.any()) continue;
        counts_.rays += static_cast<std::uint64_t>(asked.count());
        Lanes open;
        if (other.frame == vertex.body->frame) {
            const Lanes all = light.active;
            light.active = asked;
            other.shape->occlude(light);
            open = light.active;
            light.active = all;
        } else {
            if (turned_to != other.frame) {
                const Mat3 turn = relative_rotation(*vertex.body, other);
                transform(turn, light.origin, relative_origin(*vertex.body, other), turned.origin);
                transform(turn, light.direction, {}, turned.direction);
                turned.t_max = light.t_max;
                turned_to = other.frame;
            }
            turned.active = asked;
            other.shape->occlude(turned);
            open = turned.active;
        }
        for (int i = 0; i < packet_size; ++i)
            light.active.on[i] &= open.on[i] | ~asked.on[i];
        if (!light.active.any()) return;
    }
}

void PathTracer::add_emission(const BodyState& body, const Lanes& here, const SurfacePacket& surface,
                              const RayPacket& view, const HitPacket& hits, Paths& paths,
                              Channels& out) const {
    const std::size_t channels = lighting_.sun_w_m2.size();
    if (body.material == nullptr) {
        for (int i = 0; i < packet_size; ++i) {
            if (here.on[i] == 0) continue;
            if (paths.pdf[i] == delta_pdf) {
                const double mu = -dot(surface.normal.lane(i), view.direction.lane(i));
                const double radiance = sun_radiance_ * limb_factor(sun_.limb_darkening, mu);
                for (std::size_t c = 0; c < channels; ++c)
                    out.v[c][i] += paths.throughput.v[c][i] * radiance * lighting_.sun_w_m2[c];
            }
            paths.alive.on[i] = 0;
        }
        return;
    }
    if (body.built->emission.empty()) return;
    const bool sampled = body.shape->sampled_area_m2() > 0;
    for (int i = 0; i < packet_size; ++i) {
        if (here.on[i] == 0 || surface.outside.on[i] == 0) continue;
        // Compute the MIS weight of a BSDF-sampled emitter hit: balance heuristic, pdfs per steradian.
        double weight = 1;
        if (sampled && paths.pdf[i] != delta_pdf) {
            const double cosine = -dot(surface.facet_normal.lane(i), view.direction.lane(i));
            const double area_pdf = hits.t[i] * hits.t[i] / (std::max(cosine, 1e-12) * lighting_.area_m2);
            weight = paths.pdf[i] / (paths.pdf[i] + area_pdf);
        }
        for (std::size_t c = 0; c < channels; ++c)
            out.v[c][i] += weight * paths.throughput.v[c][i] * body.built->emission[c];
    }
}

void PathTracer::gather(const HitPacket& hits, Paths& paths, Lanes& left, Vertex& vertex,
                        Channels& out) const {
    vertex.count = 0;
    vertex.body = nullptr;
    vertex.here = {};
    for (int lane = 0; lane < packet_size; ++lane) {
        if (left.on[lane] == 0) continue;
        const std::int32_t index = hits.body[lane];
        const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
        if (vertex.body != nullptr && body.frame != vertex.body->frame) continue;
        if (vertex.body == nullptr) {
            vertex.body = &body;
            rays_in(body, paths, vertex.view);
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
        body.shape->surface(vertex.view, hits, index, surface);
        add_emission(body, here, surface, vertex.view, hits, paths, out);
        if (body.material == nullptr) {
            if (vertex.count == 0) vertex.body = nullptr;
            continue;
        }
        vertex.varies[vertex.count] = colour(index, here, hits, paths, vertex.view, surface, vertex.colour,
                                             vertex.varied[vertex.count]);
        for (int i = 0; i < packet_size; ++i)
            if (here.on[i] != 0) vertex.slot[i] = vertex.count;
        if (vertex.count > 0) take(here, own, vertex.surface);
        vertex.bodies[vertex.count] = index;
        vertex.on[vertex.count++] = here;
        for (int i = 0; i < packet_size; ++i)
            vertex.here.on[i] |= here.on[i];
    }
}

void PathTracer::reflectance(const Vertex& vertex, const Vec3s& light, Doubles& r) const {
    ScatterPacket angles;
    scatter_angles(vertex.surface, vertex.view.direction, light, angles);
    for (double& value : r.v)
        value = 0;
    for (int k = 0; k < vertex.count; ++k) {
        const Material& material = *row_.bodies[static_cast<std::size_t>(vertex.bodies[k])].material;
        if (material.mirror_reflectance() >= 0) continue;
        angles.varied = vertex.varies[k] ? &vertex.varied[k] : nullptr;
        Doubles own;
        material.reflectance(angles, own);
        take(vertex.on[k], own, r);
    }
}

void PathTracer::add_sun(const Vertex& vertex, const Doubles& u, const Doubles& v, const Paths& paths,
                         Channels& out) {
    // Sample the Sun's disc.
    RayPacket light;
    Doubles solid_angle;
    sample_sun(vertex.surface.position, vertex.body->sun_m, sun_, u, v, light.direction, solid_angle);
    // Evaluate the BRDF.
    Doubles r;
    reflectance(vertex, light.direction, r);
    // Trace shadow rays.
    for (int i = 0; i < packet_size; ++i) {
        light.active.on[i] = vertex.here.on[i] != 0 && r[i] > 0 ? -1 : 0;
        light.t_max[i] = no_hit;
    }
    if (!light.active.any()) return;
    block(vertex, false, light);
    // Add throughput times BRDF times radiance over the pdf.
    for (int i = 0; i < packet_size; ++i)
        r[i] = light.active.on[i] != 0 ? r[i] * solid_angle[i] : 0;
    for (std::size_t c = 0; c < lighting_.sun_w_m2.size(); ++c)
        add_light(paths.throughput.v[c], vertex.colour.v[c], r, sun_radiance_ * lighting_.sun_w_m2[c],
                  out.v[c]);
}

void PathTracer::add_lamps(const Vertex& vertex, const Paths& paths, Channels& out) {
    for (std::size_t k = 0; k < lighting_.lamps.size(); ++k) {
        const scene::Lamp& lamp = lighting_.lamps[k];
        const Mat3& from_inertial = vertex.body->from_inertial;
        const Vec3 position = from_inertial * (row_.lamps[k].position_m - vertex.body->position_m);
        const Vec3 axis = from_inertial * rotate(row_.lamps[k].orientation, {0, 0, 1});
        RayPacket light;
        Doubles share;
        for (int i = 0; i < packet_size; ++i) {
            const Vec3 to_lamp = position - vertex.surface.position.lane(i);
            const double distance = length(to_lamp);
            const Vec3 d = distance > 0 ? to_lamp / distance : Vec3{0, 0, 1};
            light.direction.set(i, d);
            light.t_max[i] = distance;
            share[i] = distance > 0 ? beam_share(lamp, -dot(axis, d)) / (distance * distance) : 0;
        }
        Doubles r;
        reflectance(vertex, light.direction, r);
        for (int i = 0; i < packet_size; ++i)
            light.active.on[i] = vertex.here.on[i] != 0 && r[i] * share[i] > 0 ? -1 : 0;
        if (!light.active.any()) continue;
        block(vertex, true, light);
        for (int i = 0; i < packet_size; ++i)
            r[i] = light.active.on[i] != 0 ? r[i] * share[i] : 0;
        for (std::size_t c = 0; c < lighting_.sun_w_m2.size() && !lamp.intensity_w_sr.empty(); ++c)
            add_light(paths.throughput.v[c], vertex.colour.v[c], r, lamp.intensity_w_sr[c], out.v[c]);
    }
}

void PathTracer::add_area_light(const Vertex& vertex, const Doubles& u, const Doubles& v, const Paths& paths,
                                bool weighted, Channels& out) {
    RayPacket light;
    Doubles share;
    for (int i = 0; i < packet_size; ++i) {
        light.direction.set(i, {0, 0, 1});
        light.t_max[i] = share[i] = 0;
    }
    // Sample a point of the emitting area: u selects the body by its area, its remainder and v the point.
    std::int32_t source[packet_size] = {};
    double before_m2 = 0;
    for (std::size_t k = 0; k < lighting_.area_lights.size(); ++k) {
        const AreaLight& area_light = lighting_.area_lights[k];
        const BodyState& lamp = row_.bodies[static_cast<std::size_t>(area_light.body)];
        const double area_m2 = area_light.area_m2;
        const bool last = k + 1 == lighting_.area_lights.size();
        const bool here = lamp.frame == vertex.body->frame;
        const Mat3 turn = here ? Mat3{} : relative_rotation(lamp, *vertex.body);
        const Vec3 offset = here ? Vec3{} : relative_origin(lamp, *vertex.body);
        const double resolved_m = lamp.shape->bounding_radius_m() * 0x1p-20;
        for (int i = 0; i < packet_size; ++i) {
            const double at_m2 = u[i] * lighting_.area_m2 - before_m2;
            if (vertex.here.on[i] == 0 || at_m2 < 0 || (at_m2 >= area_m2 && !last)) continue;
            source[i] = area_light.body;
            Vec3 point;
            Vec3 normal;
            lamp.shape->sample_area(std::min(at_m2 / area_m2, 0x1.fffffffffffffp-1), v[i], point, normal);
            if (!here) {
                point = turn * point + offset;
                normal = turn * normal;
            }
            const Vec3 to_light = point - vertex.surface.shadow_origin.lane(i);
            const double distance = length(to_light);
            if (!(distance > 0)) continue;
            const Vec3 d = to_light / distance;
            const double cosine = -dot(normal, d);
            light.direction.set(i, d);
            // Stop short of the light, by what float coordinates cannot resolve, so that it does not shadow
            // itself.
            light.t_max[i] = distance * (1 - 1e-6) - resolved_m;
            share[i] = cosine > 0 ? cosine * lighting_.area_m2 / (distance * distance) : 0.0;
        }
        before_m2 += area_m2;
    }
    // Evaluate the BRDF.
    Doubles r;
    reflectance(vertex, light.direction, r);
    // Trace shadow rays.
    for (int i = 0; i < packet_size; ++i)
        light.active.on[i] = vertex.here.on[i] != 0 && r[i] * share[i] > 0 && light.t_max[i] > 0 ? -1 : 0;
    if (!light.active.any()) return;
    block(vertex, true, light);
    for (int i = 0; i < packet_size; ++i) {
        if (light.active.on[i] == 0) continue;
        double value = r[i] * share[i];
        // Compute the MIS weight against BSDF sampling.
        if (weighted) {
            const Vec3 n = vertex.surface.normal.lane(i);
            Vec3 a;
            Vec3 b;
            orthonormal_basis(n, a, b);
            const auto local = [&](Vec3 w) { return Vec3{dot(w, a), dot(w, b), dot(w, n)}; };
            const Material& material = *row_.bodies[static_cast<std::size_t>(vertex.of[i])].material;
            const Vec3 seen = local(-vertex.view.direction.lane(i));
            const Vec3 lit = local(light.direction.lane(i));
            const ParameterPacket* const varied = vertex.varied_at(i);
            const double bsdf_pdf =
                varied != nullptr ? material.pdf_varied(*varied, i, seen, lit) : material.pdf(seen, lit);
            const double area_pdf = 1 / share[i]; // per steradian
            value *= area_pdf / (area_pdf + bsdf_pdf);
        }
        const std::vector<double>& emission =
            row_.bodies[static_cast<std::size_t>(source[i])].built->emission;
        for (std::size_t c = 0; c < lighting_.sun_w_m2.size(); ++c)
            out.v[c][i] += paths.throughput.v[c][i] * value * vertex.colour.v[c][i] * emission[c];
    }
}

void PathTracer::scatter(const Vertex& vertex, const Doubles& u, const Doubles& v, Paths& next) const {
    // Sample the BSDF.
    Vec3s in;
    Doubles scale;
    Lanes mirrored{};
    for (int i = 0; i < packet_size; ++i) {
        in.set(i, {0, 0, 1});
        scale[i] = 0;
        if (vertex.here.on[i] == 0) continue;
        const Material& material = *row_.bodies[static_cast<std::size_t>(vertex.of[i])].material;
        const double mirror = material.mirror_reflectance();
        const Vec3 n = vertex.surface.normal.lane(i);
        const Vec3 d = vertex.view.direction.lane(i);
        if (mirror >= 0) {
            in.set(i, d - 2 * dot(d, n) * n);
            scale[i] = mirror;
            mirrored.on[i] = -1;
            next.pdf[i] = delta_pdf;
        } else {
            Vec3 a;
            Vec3 b;
            orthonormal_basis(n, a, b);
            const Vec3 out{-dot(d, a), -dot(d, b), std::max(-dot(d, n), 1e-6)};
            const ParameterPacket* const varied = vertex.varied_at(i);
            const Vec3 w = varied != nullptr ? material.sample_varied(*varied, i, out, u[i], v[i])
                                             : material.sample(out, u[i], v[i]);
            const double pdf =
                varied != nullptr ? material.pdf_varied(*varied, i, out, w) : material.pdf(out, w);
            if (!(w.z > 0 && pdf > 0)) continue;
            in.set(i, a * w.x + b * w.y + n * w.z);
            scale[i] = 1 / pdf;
            next.pdf[i] = pdf;
        }
        // Shading normals can send light into the surface: absorb it.
        if (!(dot(in.lane(i), vertex.surface.facet_normal.lane(i)) > 0)) scale[i] = 0;
    }
    // Evaluate the BRDF.
    Doubles r;
    reflectance(vertex, in, r);
    // Set the next rays.
    Vec3s origin;
    Vec3s direction;
    transform(vertex.body->to_inertial, vertex.surface.shadow_origin, {}, origin);
    transform(vertex.body->to_inertial, in, {}, direction);
    take(vertex.here, origin, next.origin);
    take(vertex.here, direction, next.direction);
    for (int i = 0; i < packet_size; ++i) {
        scale[i] *= mirrored.on[i] != 0 ? 1 : r[i];
        if (vertex.here.on[i] == 0) continue;
        next.alive.on[i] = scale[i] > 0 ? -1 : 0;
        next.start.set(i, vertex.body->position_m);
    }
    // Update the throughput.
    for (std::size_t c = 0; c < lighting_.sun_w_m2.size(); ++c)
        for (int i = 0; i < packet_size; ++i)
            next.throughput.v[c][i] *= vertex.here.on[i] != 0 ? scale[i] * vertex.colour.v[c][i] : 1;
}

bool PathTracer::colour(std::int32_t index, const Lanes& here, const HitPacket& hits, const Paths& paths,
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
    // Texture filter width: that of a camera ray of the same path length.
    Doubles width_m;
    for (int i = 0; i < packet_size; ++i)
        width_m[i] = here.on[i] != 0 ? (paths.travelled_m[i] + hits.t[i]) * ray_width_rad_ : 0.0;
    Channels textured;
    built.textures->apply(*body.shape, view, hits, index, width_m, channels, surface, textured, varied);
    for (std::size_t c = 0; c < channels; ++c) {
        const double value = built.colour.empty() ? 1.0 : built.colour[c];
        for (int i = 0; i < packet_size; ++i)
            factor.v[c][i] = here.on[i] != 0 ? textured.v[c][i] * value : factor.v[c][i];
    }
    return built.textures->varies();
}

void PathTracer::shade(std::uint32_t bounce, Paths& paths, Channels& out) {
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

    Vertex vertex;
    vertex.coherent = bounce == 0;
    for (std::size_t c = 0; c < channels; ++c)
        for (int i = 0; i < packet_size; ++i)
            vertex.colour.v[c][i] = 0;
    Lanes left = paths.alive;
    while (left.any()) {
        gather(paths.hits, paths, left, vertex, out);
        if (vertex.count == 0) continue;
        // Sample lights.
        if (sun) add_sun(vertex, sun_u, sun_v, paths, out);
        add_lamps(vertex, paths, out);
        if (area) add_area_light(vertex, area_u, area_v, paths, !last, out);
        // Sample the next direction.
        if (!last) scatter(vertex, bsdf_u, bsdf_v, paths);
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
            most = std::max(most, paths.throughput.v[c][i]);
            lit = lit || out.v[c][i] > 0;
        }
        if (!lit) continue;
        const double survival = std::clamp(std::sqrt(most), 0.05, 1.0);
        if (roulette_u[i] >= survival) paths.alive.on[i] = 0;
        for (std::size_t c = 0; c < channels; ++c)
            paths.throughput.v[c][i] /= survival;
    }
}

std::size_t PathTracer::compact(std::span<Paths> paths) const {
    const std::size_t channels = lighting_.sun_w_m2.size();
    std::size_t packet = 0; // next free packet and lane
    int lane = 0;
    for (std::size_t k = 0; k < paths.size(); ++k)
        for (int i = 0; i < packet_size; ++i) {
            const Paths& from = paths[k];
            if (from.alive.on[i] == 0) continue;
            if (k != packet || i != lane) {
                // Lanes are filled in order, so that no path is overwritten before it has moved.
                Paths& to = paths[packet];
                to.origin.set(lane, from.origin.lane(i));
                to.direction.set(lane, from.direction.lane(i));
                to.start.set(lane, from.start.lane(i));
                for (std::size_t c = 0; c < channels; ++c)
                    to.throughput.v[c][lane] = from.throughput.v[c][i];
                to.pdf[lane] = from.pdf[i];
                to.travelled_m[lane] = from.travelled_m[i] + from.hits.t[i];
                to.index[lane] = from.index[i];
                to.seed[lane] = from.seed[i];
                to.owner[lane] = from.owner[i];
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

void PathTracer::follow(Paths& paths) {
    HitPacket& hits = paths.hits;
    hits.clear();
    counts_.rays += static_cast<std::uint64_t>(paths.alive.count());
    RayPacket rays;
    rays.active = paths.alive;
    rays.coherent = false;
    for (double& t : rays.t_max.v)
        t = no_hit;
    std::int32_t frame = -1;
    for (std::size_t b = 0; b < row_.bodies.size(); ++b) {
        const BodyState& body = row_.bodies[b];
        if (body.frame != frame) rays_in(body, paths, rays);
        frame = body.frame;
        body.shape->intersect(rays, static_cast<std::int32_t>(b), hits);
    }
    for (int i = 0; i < packet_size; ++i)
        if (hits.body[i] < 0) paths.alive.on[i] = 0;
}

void PathTracer::radiance(std::span<CameraRays> batch) {
    const std::size_t channels = lighting_.sun_w_m2.size();
    // Begin one path for each camera ray.
    std::array<Paths, batch_size> all;
    for (std::size_t k = 0; k < batch.size(); ++k) {
        CameraRays& rays = batch[k];
        Paths& paths = all[k];
        for (std::size_t c = 0; c < channels; ++c)
            for (int i = 0; i < packet_size; ++i) {
                rays.radiance.v[c][i] = 0;
                paths.throughput.v[c][i] = 1;
            }
        transform(row_.inertial_from_camera, rays.direction, {}, paths.direction);
        set_all(paths.origin, {});
        set_all(paths.start, row_.camera.position_m);
        paths.hits = rays.hits;
        paths.index = rays.index;
        paths.seed = rays.light_seed;
        for (int i = 0; i < packet_size; ++i) {
            paths.alive.on[i] = rays.hits.body[i] >= 0 ? -1 : 0;
            paths.pdf[i] = delta_pdf;
            paths.travelled_m[i] = 0;
            paths.owner[i] = static_cast<std::int32_t>(k) * packet_size + i;
        }
    }
    std::span<Paths> left = std::span(all).first(batch.size());
    for (std::uint32_t bounce = 0; !left.empty(); ++bounce) {
        // Shade the hits and add their light to the camera rays.
        for (Paths& paths : left) {
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
        left = left.first(compact(left));
        for (Paths& paths : left)
            follow(paths);
    }
}

} // namespace obscura::renderer
