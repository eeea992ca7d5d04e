// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/path_vertex.hpp"

#include "renderer/integrators/rough_ground.hpp"
#include "renderer/materials/hemisphere.hpp"
#include "renderer/packets/lanes.hpp"
#include "renderer/packets/vector_math.hpp"

#include <algorithm>
#include <numbers>

namespace obscura::renderer {

namespace {

/// Whether the materials of all bodies are sampled with cosine weights.
bool cosine_weighted(const RowState& row, const PathVertex& vertex) {
    return std::all_of(vertex.bodies, vertex.bodies + vertex.count, [&](std::int32_t body) {
        return row.bodies[static_cast<std::size_t>(body)].material->cosine_weighted();
    });
}

/// Directions `in` at an angle of squared cosine `cos2` to the normals, azimuth `turn` in full turns, and
/// their pdf: that of cosine weights times `density`. `inverse_pdf`: 0 in lanes that are off.
OBSCURA_VECTOR_CLONES
void set_directions(const Lanes& here, const Vec3s& normal, const Doubles& cos2, const Doubles& turn,
                    const Doubles& density, Vec3s& in, Doubles& pdf, Doubles& inverse_pdf) {
    for (int i = 0; i < packet_size; ++i) {
        double s = 0;
        double c = 0;
        sincos_turn(turn.v[i], s, c);
        const double z = __builtin_sqrt(cos2.v[i]);
        const double ring = __builtin_sqrt(1 - cos2.v[i]);
        const double x = ring * c;
        const double y = ring * s;
        // orthonormal_basis() of the normal.
        const double nx = normal.x.v[i];
        const double ny = normal.y.v[i];
        const double nz = normal.z.v[i];
        const double sign = __builtin_copysign(1.0, nz);
        const double a = -1.0 / (sign + nz);
        const double b = nx * ny * a;
        in.x.v[i] = x * (1.0 + sign * nx * nx * a) + y * b + z * nx;
        in.y.v[i] = x * (sign * b) + y * (sign + ny * ny * a) + z * ny;
        in.z.v[i] = x * (-sign * nx) - y * ny + z * nz;
        pdf.v[i] = z * std::numbers::inv_pi * density.v[i];
        inverse_pdf.v[i] = here.on[i] != 0 && z > 0 ? 1 / pdf.v[i] : 0;
    }
}

/// Sets `scale` to 0 where `in` is not above the facet.
OBSCURA_VECTOR_CLONES
void absorb_below(const Vec3s& facet_normal, const Vec3s& in, Doubles& scale) {
    for (int i = 0; i < packet_size; ++i) {
        const double cosine = in.x.v[i] * facet_normal.x.v[i] + in.y.v[i] * facet_normal.y.v[i] +
                              in.z.v[i] * facet_normal.z.v[i];
        scale.v[i] = cosine > 0 ? scale.v[i] : 0;
    }
}

/// Elevations of cosine-weighted directions, guided where the body has a guide.
struct Elevations {
    Doubles cos2;        ///< squared cosine of the angle to the normal
    Doubles density;     ///< pdf over that of cosine weights
    Doubles expectation; ///< see ElevationGuide
};

void sample_elevations(const RowState& row, const PathVertex& vertex, const Doubles& u, Elevations& out) {
    for (int i = 0; i < packet_size; ++i) {
        out.cos2[i] = 1 - u[i];
        out.density[i] = 1;
        out.expectation[i] = 1;
    }
    for (int k = 0; k < vertex.count; ++k) {
        const BodyState& body = row.bodies[static_cast<std::size_t>(vertex.bodies[k])];
        if (!body.built->guide) continue;
        Elevations own;
        body.built->guide->sample(u, own.cos2, own.density, own.expectation);
        copy_lanes(vertex.on[k], own.cos2, out.cos2);
        copy_lanes(vertex.on[k], own.density, out.density);
        copy_lanes(vertex.on[k], own.expectation, out.expectation);
    }
}

/// Samples lane by lane with each material's own method. `inverse_pdf`: 0 in lanes that are off; a mirror's
/// reflectance in lanes `mirrored`.
void sample_by_lane(const RowState& row, const PathVertex& vertex, const Elevations& elevations,
                    const Doubles& u, const Doubles& v, Vec3s& in, Doubles& pdf, Doubles& inverse_pdf,
                    Lanes& mirrored) {
    for (int i = 0; i < packet_size; ++i) {
        in.set(i, {0, 0, 1});
        inverse_pdf[i] = pdf[i] = 0;
        if (vertex.here.on[i] == 0) continue;
        const BodyState& body = row.bodies[static_cast<std::size_t>(vertex.of[i])];
        const Material& material = *body.material;
        const double mirror = material.mirror_reflectance();
        const Vec3 n = vertex.surface.normal.lane(i);
        const Vec3 d = vertex.view.direction.lane(i);
        if (mirror >= 0) {
            in.set(i, d - 2 * dot(d, n) * n);
            inverse_pdf[i] = mirror;
            mirrored.on[i] = -1;
            pdf[i] = delta_pdf;
            continue;
        }
        Vec3 a;
        Vec3 b;
        orthonormal_basis(n, a, b);
        const Vec3 out{-dot(d, a), -dot(d, b), std::max(-dot(d, n), 1e-6)};
        const ParameterPacket* const varied = vertex.varied_at(i);
        Vec3 w;
        if (material.cosine_weighted()) {
            w = cosine_hemisphere(1 - elevations.cos2[i], v[i]);
            pdf[i] = w.z * std::numbers::inv_pi * elevations.density[i];
        } else if (varied != nullptr) {
            w = material.sample_varied(*varied, i, out, u[i], v[i]);
            pdf[i] = material.pdf_varied(*varied, i, out, w);
        } else {
            w = material.sample(out, u[i], v[i]);
            pdf[i] = material.pdf(out, w);
        }
        if (!(w.z > 0 && pdf[i] > 0)) continue;
        in.set(i, a * w.x + b * w.y + n * w.z);
        inverse_pdf[i] = 1 / pdf[i];
    }
}

} // namespace

void evaluate_brdf(const RowState& row, const PathVertex& vertex, std::size_t channels, const Vec3s& light,
                   Scattered& out) {
    out.colour = &vertex.colour;
    for (double& value : out.r.v)
        value = 0;
    for (int k = 0; k < vertex.count; ++k) {
        const Material& material = *row.bodies[static_cast<std::size_t>(vertex.bodies[k])].material;
        if (material.mirror_reflectance() >= 0) continue;
        const ParameterPacket* const varied = vertex.varies[k] ? &vertex.varied[k] : nullptr;
        const Doubles* const unresolved = vertex.rougher[k] ? &vertex.unresolved : nullptr;
        Doubles own;
        if (!material.spectral() || channels == 1) {
            ground_reflectance(material, vertex.surface, vertex.view.direction, light, varied, unresolved,
                               own);
            copy_lanes(vertex.on[k], own, out.r);
            continue;
        }
        Channels bands;
        ground_reflectances(material, vertex.surface, vertex.view.direction, light, varied, unresolved,
                            channels, bands);
        if (out.colour != &out.own) {
            for (std::size_t c = 0; c < channels; ++c)
                out.own.v[c] = vertex.colour.v[c];
            out.colour = &out.own;
        }
        for (int i = 0; i < packet_size; ++i) {
            if (vertex.on[k].on[i] == 0) continue;
            double most = 0;
            for (std::size_t c = 0; c < channels; ++c)
                most = std::max(most, bands.v[c][i]);
            out.r[i] = most;
            for (std::size_t c = 0; c < channels; ++c)
                out.own.v[c][i] *= most > 0 ? bands.v[c][i] / most : 0.0;
        }
    }
}

double sample_bsdf_pdf(const RowState& row, const PathVertex& vertex, int lane, Vec3 light) {
    const Vec3 n = vertex.surface.normal.lane(lane);
    Vec3 a;
    Vec3 b;
    orthonormal_basis(n, a, b);
    const Vec3 d = vertex.view.direction.lane(lane);
    const Vec3 out{-dot(d, a), -dot(d, b), std::max(-dot(d, n), 1e-6)};
    const Vec3 in{dot(light, a), dot(light, b), dot(light, n)};
    const Material& material = *row.bodies[static_cast<std::size_t>(vertex.of[lane])].material;
    const ParameterPacket* const varied = vertex.varied_at(lane);
    const double pdf =
        varied != nullptr ? material.pdf_varied(*varied, lane, out, in) : material.pdf(out, in);
    const ElevationGuide* const guide =
        row.bodies[static_cast<std::size_t>(vertex.of[lane])].built->guide.get();
    return guide != nullptr ? pdf * guide->density(in.z * in.z) : pdf;
}

void sample_bsdf(const Instants& instants, const PathVertex& vertex, const Doubles& u, const Doubles& v,
                 std::size_t channels, PathPacket& next) {
    const RowState& row = instants.front();
    // Sample the BSDF.
    Elevations elevations;
    sample_elevations(row, vertex, u, elevations);
    Vec3s in;
    Doubles pdf;
    Doubles scale;
    Lanes mirrored{};
    if (cosine_weighted(row, vertex))
        set_directions(vertex.here, vertex.surface.normal, elevations.cos2, v, elevations.density, in, pdf,
                       scale);
    else
        sample_by_lane(row, vertex, elevations, u, v, in, pdf, scale, mirrored);
    copy_lanes(vertex.here, pdf, next.pdf);
    copy_lanes(vertex.here, elevations.expectation, next.expectation);
    // Shading normals can send light into the surface: absorb it.
    absorb_below(vertex.surface.facet_normal, in, scale);
    // Evaluate the BRDF.
    Scattered scattered;
    evaluate_brdf(row, vertex, channels, in, scattered);
    const Doubles& r = scattered.r;
    // Set the next rays.
    Vec3s origin;
    Vec3s direction;
    instants.to_inertial(vertex.body, next.instant, vertex.surface.shadow_origin, origin);
    instants.directions_to_inertial(vertex.body, next.instant, in, direction);
    copy_lanes(vertex.here, origin, next.origin);
    copy_lanes(vertex.here, direction, next.direction);
    for (int i = 0; i < packet_size; ++i) {
        scale[i] *= mirrored.on[i] != 0 ? 1 : r[i];
        if (vertex.here.on[i] == 0) continue;
        next.alive.on[i] = scale[i] > 0 ? -1 : 0;
        next.chain[i] = vertex.chain[i];
        next.start.set(i, instants.body(vertex.body, next.instant, i).seen.position_at(next.path_m(i)));
    }
    // Update the throughput.
    for (std::size_t c = 0; c < channels; ++c)
        for (int i = 0; i < packet_size; ++i)
            next.throughput.v[c][i] *= vertex.here.on[i] != 0 ? scale[i] * scattered.colour->v[c][i] : 1;
}

} // namespace obscura::renderer
