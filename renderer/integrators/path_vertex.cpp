// SPDX-License-Identifier: Apache-2.0
#include "renderer/integrators/path_vertex.hpp"

#include "renderer/integrators/tracer.hpp"
#include "renderer/packets/lanes.hpp"

#include <algorithm>

namespace obscura::renderer {

void evaluate_brdf(const RowState& row, const PathVertex& vertex, const Vec3s& light, Doubles& r) {
    ScatterPacket angles;
    scatter_angles(vertex.surface, vertex.view.direction, light, angles);
    for (double& value : r.v)
        value = 0;
    for (int k = 0; k < vertex.count; ++k) {
        const Material& material = *row.bodies[static_cast<std::size_t>(vertex.bodies[k])].material;
        if (material.mirror_reflectance() >= 0) continue;
        angles.varied = vertex.varies[k] ? &vertex.varied[k] : nullptr;
        Doubles own;
        material.reflectance(angles, own);
        copy_lanes(vertex.on[k], own, r);
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
    return varied != nullptr ? material.pdf_varied(*varied, lane, out, in) : material.pdf(out, in);
}

void sample_bsdf(const Instants& instants, const PathVertex& vertex, const Doubles& u, const Doubles& v,
                 std::size_t channels, PathPacket& next) {
    const RowState& row = instants.front();
    // Sample the BSDF.
    Vec3s in;
    Doubles scale;
    Lanes mirrored{};
    for (int i = 0; i < packet_size; ++i) {
        in.set(i, {0, 0, 1});
        scale[i] = 0;
        if (vertex.here.on[i] == 0) continue;
        const Material& material = *row.bodies[static_cast<std::size_t>(vertex.of[i])].material;
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
    evaluate_brdf(row, vertex, in, r);
    // Set the next rays.
    Vec3s origin;
    Vec3s direction;
    instants.to_inertial(vertex.body, next.instant, vertex.surface.shadow_origin, origin);
    instants.to_inertial(vertex.body, next.instant, in, direction);
    copy_lanes(vertex.here, origin, next.origin);
    copy_lanes(vertex.here, direction, next.direction);
    for (int i = 0; i < packet_size; ++i) {
        scale[i] *= mirrored.on[i] != 0 ? 1 : r[i];
        if (vertex.here.on[i] == 0) continue;
        next.alive.on[i] = scale[i] > 0 ? -1 : 0;
        next.start.set(i, instants.body(vertex.body, next.instant, i).position_m);
    }
    // Update the throughput.
    for (std::size_t c = 0; c < channels; ++c)
        for (int i = 0; i < packet_size; ++i)
            next.throughput.v[c][i] *= vertex.here.on[i] != 0 ? scale[i] * vertex.colour.v[c][i] : 1;
}

} // namespace obscura::renderer
