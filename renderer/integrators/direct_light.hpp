// SPDX-License-Identifier: Apache-2.0
// Direct light at path vertices: next-event estimation and emitter hits, combined by the balance heuristic.
#pragma once

#include "renderer/integrators/path_packet.hpp"
#include "renderer/integrators/path_vertex.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/lights/lighting.hpp"

namespace obscura::renderer {

/// Direct light of all light sources, one channel per spectral band, radiance in W m-2 sr-1.
///
/// BSDF-sampled emitter hits (add_emission) and area samples (add_area_light) are combined by the balance
/// heuristic (Veach, Robust Monte Carlo Methods for Light Transport Simulation, 1997, ch. 9), with pdfs per
/// steradian. The Sun's disc and lamps are sampled only; the Sun counts as hit for camera and mirrored rays.
///
/// Each sampling function samples the light, evaluates the BRDF, traces shadow rays and adds to `out`.
/// Thread-bound, as Tracer.
class DirectLight {
public:
    /// All arguments must outlive the object.
    DirectLight(const Instants& instants, const Lighting& lighting, const scene::Sun& sun, RayCounts& counts);

    /// Adds emission at the hits `here` of `body`, whose number is `index`, with its MIS weight. Paths that
    /// hit the Sun end. `factor`: on the body's emission, by its texture; null: 1.
    void add_emission(const BodyState& body, std::int32_t index, const Lanes& here,
                      const SurfacePacket& surface, const RayPacket& view, const HitPacket& hits,
                      PathPacket& paths, const Channels* factor, Channels& out) const;
    /// Light of the Sun's disc, from one direction. `mis_weight`: factor by lane; null: 1.
    void add_sun(const PathVertex& vertex, const Doubles& u, const Doubles& v, const PathPacket& paths,
                 const Doubles* mis_weight, Channels& out);
    /// Light of every lamp.
    void add_lamps(const PathVertex& vertex, const PathPacket& paths, Channels& out);
    /// Light of one point of the emitting bodies. `weighted`: with the MIS weight against BSDF sampling.
    void add_area_light(const PathVertex& vertex, const Doubles& u, const Doubles& v, const PathPacket& paths,
                        bool weighted, Channels& out);

private:
    /// Factor of ColourProducts for the light of a body, which the Sun may be.
    [[nodiscard]] double product(ColourProducts::Chain chain, std::int32_t body, std::size_t band) const;
    /// Adds light of a source that the vertex reflects: throughput * `colour` * `light` * `scale`.
    void add_reflected(const PathVertex& vertex, const Channels& colour, const PathPacket& paths,
                       std::size_t source, std::size_t band, const Doubles& light, double scale,
                       Channels& out) const;
    /// Switches off blocked shadow rays. Towards the Sun only the known occluders of a body are tested,
    /// else (`all_bodies`) all.
    void occlude(const PathVertex& vertex, bool all_bodies, const PathPacket& paths, RayPacket& light);

    const Instants instants_;
    const RowState& row_; ///< the first of them: for what is the same at all
    const Lighting& lighting_;
    const scene::Sun& sun_;
    double sun_radiance_; ///< per irradiance at 1 au, 1/sr
    RayCounts& counts_;
};

} // namespace obscura::renderer
