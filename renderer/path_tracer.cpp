#include "renderer/path_tracer.hpp"

#include "renderer/frames.hpp"
#include "renderer/motion.hpp"
#include "renderer/sunlight.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {
namespace {

/// Paths are followed without question up to this many reflections.
constexpr std::uint32_t certain_bounces = 3;

/// Share of a lamp's axial intensity at an angle to its axis.
double beam_share(const scene::Lamp& lamp, double cos_angle) {
    const double angle = std::acos(std::clamp(cos_angle, -1.0, 1.0));
    switch (lamp.beam) {
    case scene::Lamp::Beam::uniform:
        return angle <= lamp.half_angle_rad ? 1 : 0;
    case scene::Lamp::Beam::gaussian: {
        const double x = angle / lamp.half_angle_rad;
        return std::exp(-2 * x * x);
    }
    case scene::Lamp::Beam::point:
        break;
    }
    return 1;
}

} // namespace

bool Lighting::has_sun() const {
    return std::any_of(sun_w_m2.begin(), sun_w_m2.end(), [](double e) { return e > 0; });
}

Lighting make_lighting(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                       std::vector<double> sun_w_m2, std::uint32_t max_bounces) {
    Lighting lighting;
    lighting.sun_w_m2 = std::move(sun_w_m2);
    lighting.lamps = scene.lamps;
    lighting.max_bounces = max_bounces;
    for (std::size_t b = 0; b < bodies.size(); ++b) {
        if (bodies[b].emission.empty() || !(bodies[b].shape->sampled_area_m2() > 0)) continue;
        lighting.area_lights.push_back(static_cast<std::int32_t>(b));
        lighting.area_m2 += bodies[b].shape->sampled_area_m2();
    }
    return lighting;
}

/// 16 paths: the ray each is on, and what it carries.
struct PathTracer::Paths {
    Vec3s origin;                     ///< inertial axes, relative to the anchor
    Vec3s direction;                  ///< inertial axes
    std::int32_t anchor[packet_size]; ///< the body the ray left; -1: the camera
    Lanes alive;
    Channels carried;
    /// Density with which the direction was drawn; no_hit where no other technique could have found it: the
    /// camera's own rays and mirrored ones.
    Doubles density;
    Doubles travelled_m; ///< from the camera
};

/// The hits of one body and what it needs to light them; everything in the body's frame.
struct PathTracer::Vertex {
    std::int32_t index;
    const BodyState& body;
    Lanes here; ///< the lanes on this body
    RayPacket view;
    SurfacePacket surface;
    Channels colour; ///< factor on the material's reflectance
};

PathTracer::PathTracer(const RowState& row, const Lighting& lighting, const scene::Sun& sun,
                       RayCounts& counts)
    : Tracer(row, sun, counts), lighting_(lighting) {}

void PathTracer::block(const Vertex& vertex, bool all_bodies, RayPacket& light) {
    light.origin = vertex.surface.shadow_origin;
    // A convex body never shades its own outside, always its inside.
    RayPacket self = light;
    if (!vertex.body.shape->shadows_itself())
        for (int i = 0; i < packet_size; ++i)
            self.active.on[i] = vertex.surface.outside.on[i] != 0 ? 0 : light.active.on[i];
    if (self.active.any()) {
        counts_.rays += static_cast<std::uint64_t>(self.active.count());
        const Lanes asked = self.active;
        vertex.body.shape->occlude(self);
        for (int i = 0; i < packet_size; ++i)
            if (asked.on[i] != 0 && self.active.on[i] == 0) light.active.on[i] = 0;
    }
    if (!all_bodies) {
        for (const std::int32_t other : vertex.body.occluders)
            occlude_by(vertex.body, other, vertex.surface.shadow_origin, light);
        return;
    }
    for (std::size_t b = 0; b < row_.bodies.size(); ++b)
        if (static_cast<std::int32_t>(b) != vertex.index && row_.bodies[b].material != nullptr)
            occlude_by(vertex.body, static_cast<std::int32_t>(b), vertex.surface.shadow_origin, light);
}

void PathTracer::meet_light(std::int32_t index, const Vertex& vertex, const HitPacket& hits, Paths& paths,
                            Channels& out) const {
    const BodyState& body = row_.bodies[static_cast<std::size_t>(index)];
    const std::size_t channels = lighting_.sun_w_m2.size();
    if (body.material == nullptr) {
        for (int i = 0; i < packet_size; ++i) {
            if (vertex.here.on[i] == 0) continue;
            if (paths.density[i] == no_hit) {
                const double mu = -dot(vertex.surface.normal.lane(i), vertex.view.direction.lane(i));
                const double radiance = sun_radiance_ * limb_factor(sun_.limb_darkening, mu);
                for (std::size_t c = 0; c < channels; ++c)
                    out.v[c][i] += paths.carried.v[c][i] * radiance * lighting_.sun_w_m2[c];
            }
            paths.alive.on[i] = 0;
        }
        return;
    }
    if (body.built->emission.empty()) return;
    const bool sampled = body.shape->sampled_area_m2() > 0;
    for (int i = 0; i < packet_size; ++i) {
        if (vertex.here.on[i] == 0 || vertex.surface.outside.on[i] == 0) continue;
        double weight = 1;
        if (sampled && paths.density[i] != no_hit) {
            const double cosine = -dot(vertex.surface.facet_normal.lane(i), vertex.view.direction.lane(i));
            const double other = hits.t[i] * hits.t[i] / (std::max(cosine, 1e-12) * lighting_.area_m2);
            weight = paths.density[i] / (paths.density[i] + other);
        }
        for (std::size_t c = 0; c < channels; ++c)
            out.v[c][i] += weight * paths.carried.v[c][i] * body.built->emission[c];
    }
}

void PathTracer::add_sun(const Vertex& vertex, const Doubles& u, const Doubles& v, const Paths& paths,
                         Channels& out) {
    RayPacket light;
    Doubles solid_angle;
    sample_sun(vertex.surface.position, vertex.body.sun_m, sun_, u, v, light.direction, solid_angle);
    ScatterPacket angles;
    scatter_angles(vertex.surface, vertex.view.direction, light.direction, angles);
    Doubles r;
    vertex.body.material->reflectance(angles, r);
    for (int i = 0; i < packet_size; ++i) {
        light.active.on[i] = vertex.here.on[i] != 0 && r[i] > 0 ? -1 : 0;
        light.t_max[i] = no_hit;
    }
    if (!light.active.any()) return;
    block(vertex, false, light);
    for (std::size_t c = 0; c < lighting_.sun_w_m2.size(); ++c) {
        const double scale = sun_radiance_ * lighting_.sun_w_m2[c];
        for (int i = 0; i < packet_size; ++i)
            if (light.active.on[i] != 0)
                out.v[c][i] +=
                    paths.carried.v[c][i] * r[i] * solid_angle[i] * (vertex.colour.v[c][i] * scale);
    }
}

void PathTracer::add_lamps(const Vertex& vertex, const Paths& paths, Channels& out) {
    for (std::size_t k = 0; k < lighting_.lamps.size(); ++k) {
        const scene::Lamp& lamp = lighting_.lamps[k];
        const Mat3 from_inertial = transposed(vertex.body.to_inertial);
        const Vec3 position = from_inertial * (row_.lamps[k].position_m - vertex.body.position_m);
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
        ScatterPacket angles;
        scatter_angles(vertex.surface, vertex.view.direction, light.direction, angles);
        Doubles r;
        vertex.body.material->reflectance(angles, r);
        for (int i = 0; i < packet_size; ++i)
            light.active.on[i] = vertex.here.on[i] != 0 && r[i] * share[i] > 0 ? -1 : 0;
        if (!light.active.any()) continue;
        block(vertex, true, light);
        for (std::size_t c = 0; c < lighting_.sun_w_m2.size() && !lamp.intensity_w_sr.empty(); ++c) {
            for (int i = 0; i < packet_size; ++i)
                if (light.active.on[i] != 0)
                    out.v[c][i] += paths.carried.v[c][i] * r[i] * share[i] *
                                   (vertex.colour.v[c][i] * lamp.intensity_w_sr[c]);
        }
    }
}

void PathTracer::add_area_light(const Vertex& vertex, const Doubles& choice, const Doubles& u,
                                const Doubles& v, const Paths& paths, bool weighted, Channels& out) {
    RayPacket light;
    Doubles share;
    std::int32_t source[packet_size];
    for (int i = 0; i < packet_size; ++i) {
        // A body by its share of the area; what is left of the choice selects the triangle.
        double at_m2 = choice[i] * lighting_.area_m2;
        std::size_t k = 0;
        while (k + 1 < lighting_.area_lights.size()) {
            const double area =
                row_.bodies[static_cast<std::size_t>(lighting_.area_lights[k])].shape->sampled_area_m2();
            if (at_m2 < area) break;
            at_m2 -= area;
            ++k;
        }
        source[i] = lighting_.area_lights[k];
        const BodyState& lamp = row_.bodies[static_cast<std::size_t>(source[i])];
        Vec3 point;
        Vec3 normal;
        lamp.shape->sample_area(std::min(at_m2 / lamp.shape->sampled_area_m2(), 1.0), u[i], v[i], point,
                                normal);
        const Mat3 turn = relative_rotation(lamp, vertex.body);
        const Vec3 to_light =
            turn * point + relative_origin(lamp, vertex.body) - vertex.surface.shadow_origin.lane(i);
        const double distance = length(to_light);
        const Vec3 d = distance > 0 ? to_light / distance : Vec3{0, 0, 1};
        const double cosine = -dot(turn * normal, d);
        light.direction.set(i, d);
        // The light itself must not be met: stop short of it by what float coordinates cannot resolve.
        light.t_max[i] = distance * (1 - 1e-6) - lamp.shape->bounding_radius_m() * 0x1p-20;
        share[i] = distance > 0 && cosine > 0 ? cosine * lighting_.area_m2 / (distance * distance) : 0.0;
    }
    ScatterPacket angles;
    scatter_angles(vertex.surface, vertex.view.direction, light.direction, angles);
    Doubles r;
    vertex.body.material->reflectance(angles, r);
    for (int i = 0; i < packet_size; ++i)
        light.active.on[i] = vertex.here.on[i] != 0 && r[i] * share[i] > 0 && light.t_max[i] > 0 ? -1 : 0;
    if (!light.active.any()) return;
    block(vertex, true, light);
    for (int i = 0; i < packet_size; ++i) {
        if (light.active.on[i] == 0) continue;
        double value = r[i] * share[i];
        if (weighted) {
            const Vec3 n = vertex.surface.normal.lane(i);
            Vec3 a;
            Vec3 b;
            orthonormal_basis(n, a, b);
            const auto local = [&](Vec3 w) { return Vec3{dot(w, a), dot(w, b), dot(w, n)}; };
            const double other = vertex.body.material->pdf(local(-vertex.view.direction.lane(i)),
                                                           local(light.direction.lane(i)));
            const double own = 1 / share[i]; // density of this direction, per steradian
            value *= own / (own + other);
        }
        const std::vector<double>& emission =
            row_.bodies[static_cast<std::size_t>(source[i])].built->emission;
        for (std::size_t c = 0; c < lighting_.sun_w_m2.size(); ++c)
            out.v[c][i] += paths.carried.v[c][i] * value * vertex.colour.v[c][i] * emission[c];
    }
}

void PathTracer::scatter(const Vertex& vertex, const Doubles& u, const Doubles& v, Paths& next) const {
    const Material& material = *vertex.body.material;
    const double mirror = material.mirror_reflectance();
    Vec3s in;
    Doubles scale;
    for (int i = 0; i < packet_size; ++i) {
        in.set(i, {0, 0, 1});
        scale[i] = 0;
        if (vertex.here.on[i] == 0) continue;
        const Vec3 n = vertex.surface.normal.lane(i);
        const Vec3 d = vertex.view.direction.lane(i);
        if (mirror >= 0) {
            in.set(i, d - 2 * dot(d, n) * n);
            scale[i] = mirror;
            next.density[i] = no_hit;
        } else {
            Vec3 a;
            Vec3 b;
            orthonormal_basis(n, a, b);
            const Vec3 out{-dot(d, a), -dot(d, b), std::max(-dot(d, n), 1e-6)};
            const Vec3 w = material.sample(out, u[i], v[i]);
            const double density = material.pdf(out, w);
            if (!(w.z > 0 && density > 0)) continue;
            in.set(i, a * w.x + b * w.y + n * w.z);
            scale[i] = 1 / density;
            next.density[i] = density;
        }
        // Interpolated normals can send light into the surface: it ends there.
        if (!(dot(in.lane(i), vertex.surface.facet_normal.lane(i)) > 0)) scale[i] = 0;
    }
    if (mirror < 0) {
        ScatterPacket angles;
        scatter_angles(vertex.surface, vertex.view.direction, in, angles);
        Doubles r;
        material.reflectance(angles, r);
        for (int i = 0; i < packet_size; ++i)
            scale[i] *= r[i];
    }
    for (int i = 0; i < packet_size; ++i) {
        if (vertex.here.on[i] == 0) continue;
        next.alive.on[i] = scale[i] > 0 ? -1 : 0;
        next.anchor[i] = vertex.index;
        next.origin.set(i, vertex.body.to_inertial * vertex.surface.shadow_origin.lane(i));
        next.direction.set(i, vertex.body.to_inertial * in.lane(i));
        for (std::size_t c = 0; c < lighting_.sun_w_m2.size(); ++c)
            next.carried.v[c][i] *= scale[i] * vertex.colour.v[c][i];
    }
}

void PathTracer::colour(const HitPacket& hits, const Paths& paths, Vertex& vertex) const {
    const BuiltBody& built = *vertex.body.built;
    const std::size_t channels = lighting_.sun_w_m2.size();
    if (!built.paint) {
        for (std::size_t c = 0; c < channels; ++c)
            for (int i = 0; i < packet_size; ++i)
                vertex.colour.v[c][i] = built.colour.empty() ? 1.0 : built.colour[c];
        return;
    }
    // Bounced rays are taken to be as wide as a camera ray that has come as far.
    Doubles width_m;
    for (int i = 0; i < packet_size; ++i)
        width_m[i] = vertex.here.on[i] != 0 ? (paths.travelled_m[i] + hits.t[i]) * ray_width_rad_ : 0.0;
    built.paint->apply(*vertex.body.shape, vertex.view, hits, vertex.index, width_m, channels, vertex.surface,
                       vertex.colour);
    if (built.colour.empty()) return;
    for (std::size_t c = 0; c < channels; ++c)
        for (int i = 0; i < packet_size; ++i)
            vertex.colour.v[c][i] *= built.colour[c];
}

void PathTracer::radiance(const Vec3s& direction, const HitPacket& first_hits, SampleStream& random,
                          Channels& out) {
    const std::size_t channels = lighting_.sun_w_m2.size();
    Paths paths;
    for (std::size_t c = 0; c < channels; ++c)
        for (int i = 0; i < packet_size; ++i) {
            out.v[c][i] = 0;
            paths.carried.v[c][i] = 1;
        }
    transform(row_.inertial_from_camera, direction, {}, paths.direction);
    set_all(paths.origin, {});
    for (int i = 0; i < packet_size; ++i) {
        paths.anchor[i] = -1;
        paths.alive.on[i] = first_hits.body[i] >= 0 ? -1 : 0;
        paths.density[i] = no_hit;
        paths.travelled_m[i] = 0;
    }
    const auto rays_in = [&](const BodyState& body, RayPacket& rays) {
        const Mat3 from_inertial = transposed(body.to_inertial);
        for (int i = 0; i < packet_size; ++i) {
            const std::int32_t anchor = paths.anchor[i];
            const Vec3 start = anchor < 0 ? row_.camera.position_m
                                          : row_.bodies[static_cast<std::size_t>(anchor)].position_m;
            rays.origin.set(i, from_inertial * (paths.origin.lane(i) + (start - body.position_m)));
            rays.direction.set(i, from_inertial * paths.direction.lane(i));
        }
    };

    HitPacket hits = first_hits;
    for (std::uint32_t bounce = 0;; ++bounce) {
        // The same pairs are taken from the stream whatever happens, so that every bounce has its own.
        Doubles sun_u;
        Doubles sun_v;
        Doubles choice;
        Doubles unused;
        Doubles area_u;
        Doubles area_v;
        Doubles turn_u;
        Doubles turn_v;
        random.next(sun_u, sun_v);
        random.next(choice, unused);
        random.next(area_u, area_v);
        random.next(turn_u, turn_v);
        const bool last = bounce >= lighting_.max_bounces;

        Lanes left = paths.alive;
        for (int lane = 0; lane < packet_size; ++lane) {
            if (left.on[lane] == 0) continue;
            const std::int32_t index = hits.body[lane];
            Vertex vertex{index, row_.bodies[static_cast<std::size_t>(index)], {}, {}, {}, {}};
            for (int i = 0; i < packet_size; ++i) {
                const bool here = left.on[i] != 0 && hits.body[i] == index;
                vertex.here.on[i] = here ? -1 : 0;
                if (here) left.on[i] = 0;
            }
            rays_in(vertex.body, vertex.view);
            vertex.body.shape->surface(vertex.view, hits, index, vertex.surface);
            meet_light(index, vertex, hits, paths, out);
            if (vertex.body.material == nullptr) continue;
            colour(hits, paths, vertex);
            if (vertex.body.material->mirror_reflectance() < 0) {
                if (lighting_.has_sun()) add_sun(vertex, sun_u, sun_v, paths, out);
                add_lamps(vertex, paths, out);
                if (!lighting_.area_lights.empty())
                    add_area_light(vertex, choice, area_u, area_v, paths, !last, out);
            }
            if (!last) scatter(vertex, turn_u, turn_v, paths);
        }
        if (last) return;
        if (bounce + 1 >= certain_bounces)
            for (int i = 0; i < packet_size; ++i) {
                if (paths.alive.on[i] == 0) continue;
                double most = 0;
                for (std::size_t c = 0; c < channels; ++c)
                    most = std::max(most, paths.carried.v[c][i]);
                const double chance = std::clamp(most, 0.05, 1.0);
                if (unused[i] >= chance) paths.alive.on[i] = 0;
                for (std::size_t c = 0; c < channels; ++c)
                    paths.carried.v[c][i] /= chance;
            }
        if (!paths.alive.any()) return;

        for (int i = 0; i < packet_size; ++i)
            if (hits.body[i] >= 0) paths.travelled_m[i] += hits.t[i];
        hits.clear();
        counts_.rays += static_cast<std::uint64_t>(paths.alive.count());
        RayPacket rays;
        rays.active = paths.alive;
        for (double& t : rays.t_max.v)
            t = no_hit;
        for (std::size_t b = 0; b < row_.bodies.size(); ++b) {
            rays_in(row_.bodies[b], rays);
            row_.bodies[b].shape->intersect(rays, static_cast<std::int32_t>(b), hits);
        }
        for (int i = 0; i < packet_size; ++i)
            if (hits.body[i] < 0) paths.alive.on[i] = 0;
    }
}

} // namespace obscura::renderer
