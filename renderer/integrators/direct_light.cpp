// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/direct_light.hpp"

#include "renderer/lights/sunlight.hpp"
#include "renderer/shapes/stretched_rays.hpp"
#include "renderer/world/motion.hpp"

#include <algorithm>

namespace obscura::renderer {
namespace {

/// out += throughput * colour * light * scale, lane by lane.
OBSCURA_VECTOR_CLONES
void add_light(const Doubles& throughput, const Doubles& colour, const Doubles& light, double scale,
               Doubles& out) {
    for (int i = 0; i < packet_size; ++i)
        out.v[i] += throughput.v[i] * light.v[i] * (colour.v[i] * scale);
}

} // namespace

DirectLight::DirectLight(const Instants& instants, const Lighting& lighting, const scene::Sun& sun,
                         RayCounts& counts)
    : instants_(instants),
      row_(instants_.front()),
      lighting_(lighting),
      sun_(sun),
      sun_radiance_(sun_radiance_per_irradiance(sun.radius_m)),
      counts_(counts) {}

double DirectLight::product(ColourProducts::Chain chain, std::int32_t body, std::size_t band) const {
    const ColourProducts& products = *lighting_.products;
    return products.empty() ? 1 : products.factor(chain, products.source_of_body(body), band);
}

void DirectLight::add_emission(const BodyState& body, std::int32_t index, const Lanes& here,
                               const SurfacePacket& surface, const RayPacket& view, const HitPacket& hits,
                               PathPacket& paths, const Channels* factor, Channels& out) const {
    const std::size_t channels = lighting_.sun_w_m2.size();
    if (body.material == nullptr) {
        for (int i = 0; i < packet_size; ++i) {
            if (here.on[i] == 0) continue;
            if (paths.pdf[i] == delta_pdf) {
                const double mu = -dot(surface.normal.lane(i), view.direction.lane(i));
                const double radiance = sun_radiance_ * limb_factor(sun_.limb_darkening, mu);
                for (std::size_t c = 0; c < channels; ++c)
                    out.v[c][i] += paths.throughput.v[c][i] * radiance * lighting_.sun_w_m2[c] *
                                   product(paths.chain[i], index, c);
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
            out.v[c][i] += weight * paths.throughput.v[c][i] * body.built->emission[c] *
                           (factor != nullptr ? factor->v[c][i] : 1.0) * product(paths.chain[i], index, c);
    }
}

void DirectLight::add_reflected(const PathVertex& vertex, const Channels& colour, const PathPacket& paths,
                                std::size_t source, std::size_t band, const Doubles& light, double scale,
                                Channels& out) const {
    const ColourProducts& products = *lighting_.products;
    if (products.empty()) {
        add_light(paths.throughput.v[band], colour.v[band], light, scale, out.v[band]);
        return;
    }
    Doubles weighted;
    for (int i = 0; i < packet_size; ++i)
        weighted[i] = light[i] != 0 ? light[i] * products.factor(vertex.chain[i], source, band) : 0;
    add_light(paths.throughput.v[band], colour.v[band], weighted, scale, out.v[band]);
}

void DirectLight::add_sun(const PathVertex& vertex, const Doubles& u, const Doubles& v,
                          const PathPacket& paths, const Doubles* mis_weight, Channels& out) {
    // Sample the Sun's disc.
    RayPacket light;
    Doubles solid_angle;
    instants_.sample_sun(vertex.body, paths.instant, vertex.surface.position, sun_, u, v, light.direction,
                         solid_angle);
    // Evaluate the BRDF.
    Scattered scattered;
    evaluate_brdf(row_, vertex, lighting_.sun_w_m2.size(), light.direction, scattered);
    Doubles& r = scattered.r;
    // Trace shadow rays.
    for (int i = 0; i < packet_size; ++i) {
        light.active.on[i] = vertex.here.on[i] != 0 && r[i] > 0 ? -1 : 0;
        light.t_max[i] = no_hit;
    }
    if (!light.active.any()) return;
    occlude(vertex, false, paths, light);
    // Add throughput times BRDF times radiance over the pdf.
    for (int i = 0; i < packet_size; ++i)
        r[i] = light.active.on[i] != 0 ? r[i] * solid_angle[i] : 0;
    if (mis_weight != nullptr)
        for (int i = 0; i < packet_size; ++i)
            r[i] *= (*mis_weight)[i];
    for (std::size_t c = 0; c < lighting_.sun_w_m2.size(); ++c)
        add_reflected(vertex, *scattered.colour, paths, ColourProducts::sun, c, r,
                      sun_radiance_ * lighting_.sun_w_m2[c], out);
}

void DirectLight::add_lamps(const PathVertex& vertex, const PathPacket& paths, Channels& out) {
    for (std::size_t k = 0; k < lighting_.lamps.size(); ++k) {
        const scene::Lamp& lamp = lighting_.lamps[k];
        Vec3 position; // of the lamp, in the vertex's frame
        Vec3 axis;
        RayPacket light;
        Doubles falloff; // relative intensity over the squared distance, m-2
        for (int i = 0; i < packet_size; ++i) {
            const RowState& row = instants_.at(paths.instant, i);
            const BodyState& body = row.bodies[static_cast<std::size_t>(vertex.body)];
            const ApparentBody& from = row.lamps[k];
            const bool moves = body.seen.moves() || from.moves();
            if (i == 0 || !instants_.one() || moves) {
                const double path_m = paths.path_m(i);
                position = body.from_inertial * (from.position_at(path_m) - body.seen.position_at(path_m));
                axis = body.from_inertial * rotate(from.pose.orientation, {0, 0, 1});
            }
            Vec3 to_lamp = position - vertex.surface.position.lane(i);
            // The lamp moves on while its light comes here.
            if (moves)
                to_lamp = to_lamp + length(to_lamp) * (body.from_inertial * (body.seen.beta - from.beta));
            const double distance = length(to_lamp);
            const Vec3 d = distance > 0 ? to_lamp / distance : Vec3{0, 0, 1};
            light.direction.set(i, d);
            light.t_max[i] = distance;
            falloff[i] = distance > 0 ? beam_share(lamp, -dot(axis, d)) / (distance * distance) : 0;
        }
        Scattered scattered;
        evaluate_brdf(row_, vertex, lighting_.sun_w_m2.size(), light.direction, scattered);
        Doubles& r = scattered.r;
        for (int i = 0; i < packet_size; ++i)
            light.active.on[i] = vertex.here.on[i] != 0 && r[i] * falloff[i] > 0 ? -1 : 0;
        if (!light.active.any()) continue;
        occlude(vertex, true, paths, light);
        for (int i = 0; i < packet_size; ++i)
            r[i] = light.active.on[i] != 0 ? r[i] * falloff[i] : 0;
        for (std::size_t c = 0; c < lighting_.sun_w_m2.size() && !lamp.intensity_w_sr.empty(); ++c)
            add_reflected(vertex, *scattered.colour, paths, lighting_.products->source_of_lamp(k), c, r,
                          lamp.intensity_w_sr[c], out);
    }
}

void DirectLight::add_area_light(const PathVertex& vertex, const Doubles& u, const Doubles& v,
                                 const PathPacket& paths, bool weighted, Channels& out) {
    RayPacket light;
    Doubles inverse_pdf; // of the direction by area sampling, sr; 0: no light
    for (int i = 0; i < packet_size; ++i) {
        light.direction.set(i, {0, 0, 1});
        light.t_max[i] = inverse_pdf[i] = 0;
    }
    // Sample a point of the emitting area: u selects the body by its area, its remainder and v the point.
    std::int32_t source[packet_size] = {};
    double before_m2 = 0;
    for (std::size_t k = 0; k < lighting_.area_lights.size(); ++k) {
        const AreaLight& area_light = lighting_.area_lights[k];
        const BodyState& lamp = row_.bodies[static_cast<std::size_t>(area_light.body)];
        const double area_m2 = area_light.area_m2;
        const bool last = k + 1 == lighting_.area_lights.size();
        const bool here = lamp.frame == row_.bodies[static_cast<std::size_t>(vertex.body)].frame;
        Mat3 turn;
        Vec3 offset;
        bool turned = false;
        const double resolved_m = lamp.shape->bounding_radius_m() * 0x1p-20;
        for (int i = 0; i < packet_size; ++i) {
            const double at_m2 = u[i] * lighting_.area_m2 - before_m2;
            if (vertex.here.on[i] == 0 || at_m2 < 0 || (at_m2 >= area_m2 && !last)) continue;
            source[i] = area_light.body;
            Vec3 point, normal;
            lamp.shape->sample_area(std::min(at_m2 / area_m2, 0x1.fffffffffffffp-1), v[i], point, normal);
            if (!here) {
                const BodyState& from = instants_.body(area_light.body, paths.instant, i);
                const BodyState& to = instants_.body(vertex.body, paths.instant, i);
                if (!turned || !instants_.one() || tilts(from, to)) {
                    turn = relative_rotation(from, to);
                    offset = relative_origin(from, to, paths.path_m(i));
                    turned = true;
                }
                point = turn * point + offset;
                normal = turn * normal;
                // The light moves on while its rays come here.
                if (tilts(from, to))
                    point = point + length(point - vertex.surface.shadow_origin.lane(i)) *
                                        (to.from_inertial * (to.seen.beta - from.seen.beta));
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
            inverse_pdf[i] = cosine > 0 ? cosine * lighting_.area_m2 / (distance * distance) : 0.0;
        }
        before_m2 += area_m2;
    }
    // Evaluate the BRDF.
    Scattered scattered;
    evaluate_brdf(row_, vertex, lighting_.sun_w_m2.size(), light.direction, scattered);
    const Doubles& r = scattered.r;
    // Trace shadow rays.
    for (int i = 0; i < packet_size; ++i)
        light.active.on[i] =
            vertex.here.on[i] != 0 && r[i] * inverse_pdf[i] > 0 && light.t_max[i] > 0 ? -1 : 0;
    if (!light.active.any()) return;
    occlude(vertex, true, paths, light);
    for (int i = 0; i < packet_size; ++i) {
        if (light.active.on[i] == 0) continue;
        double value = r[i] * inverse_pdf[i];
        // Compute the MIS weight against BSDF sampling.
        if (weighted) {
            const double area_pdf = 1 / inverse_pdf[i];
            const double bsdf_pdf = sample_bsdf_pdf(row_, vertex, i, light.direction.lane(i));
            value *= area_pdf / (area_pdf + bsdf_pdf);
        }
        const auto& emission = row_.bodies[static_cast<std::size_t>(source[i])].built->emission;
        for (std::size_t c = 0; c < lighting_.sun_w_m2.size(); ++c)
            out.v[c][i] += paths.throughput.v[c][i] * value * scattered.colour->v[c][i] * emission[c] *
                           product(vertex.chain[i], source[i], c);
    }
}

void DirectLight::occlude(const PathVertex& vertex, bool all_bodies, const PathPacket& paths,
                          RayPacket& light) {
    light.level_u = paths.level_u;
    light.origin = vertex.surface.shadow_origin;
    light.coherent = vertex.coherent;
    RayPacket turned; // in the frame `turned_to`
    turned.coherent = vertex.coherent;
    turned.level_u = paths.level_u;
    std::int32_t turned_to = -1;
    for (std::size_t b = 0; b < row_.bodies.size(); ++b) {
        const BodyState& other = row_.bodies[b];
        if (other.material == nullptr) continue;
        const auto index = static_cast<std::int32_t>(b);
        Lanes tested{};
        for (int k = 0; k < vertex.count; ++k) {
            const BodyState& own = row_.bodies[static_cast<std::size_t>(vertex.bodies[k])];
            if (vertex.bodies[k] != index && !all_bodies &&
                !std::binary_search(own.occluders.begin(), own.occluders.end(), index))
                continue;
            // A convex body never shades its own outside, always its inside.
            const bool inside_only = vertex.bodies[k] == index && !own.shape->shadows_itself();
            for (int i = 0; i < packet_size; ++i)
                tested.on[i] |= vertex.on[k].on[i] & light.active.on[i] &
                                (inside_only ? ~vertex.surface.outside.on[i] : -1);
        }
        if (!tested.any()) continue;
        counts_.rays += static_cast<std::uint64_t>(tested.count());
        Lanes unblocked;
        if (other.frame == row_.bodies[static_cast<std::size_t>(vertex.body)].frame) {
            const Lanes all = light.active;
            light.active = tested;
            light.detail = other.detail_view();
            other.shape->occlude(light);
            unblocked = light.active;
            light.active = all;
        } else {
            if (turned_to != other.frame) {
                Doubles path_m;
                for (int i = 0; i < packet_size; ++i)
                    path_m[i] = paths.path_m(i);
                instants_.between(vertex.body, index, paths.instant, light.origin, light.direction, path_m,
                                  turned);
                turned.t_max = light.t_max;
                stretch_limits(turned);
                turned_to = other.frame;
            }
            turned.active = tested;
            turned.detail = other.detail_view();
            other.shape->occlude(turned);
            unblocked = turned.active;
        }
        for (int i = 0; i < packet_size; ++i)
            light.active.on[i] &= unblocked.on[i] | ~tested.on[i];
        if (!light.active.any()) return;
    }
}

} // namespace obscura::renderer
