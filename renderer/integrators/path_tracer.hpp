// SPDX-License-Identifier: Apache-2.0
// Path tracer: emission, direct light of all light sources, and any number of reflections.
#pragma once

#include "renderer/integrators/tracer.hpp"
#include "renderer/lights/lighting.hpp"

#include <cstdint>
#include <span>

namespace obscura::renderer {

/// Backward path tracer with next-event estimation: one channel per spectral band, radiance in W m-2 sr-1.
///
/// At each vertex: emission; direct light from the Sun's disc, each lamp, and one point of the emitting
/// bodies; then one BSDF-sampled direction. BSDF-sampled emitter hits and area samples are combined by the
/// balance heuristic (Veach, Robust Monte Carlo Methods for Light Transport Simulation, 1997, ch. 9). The
/// Sun is never found by BSDF sampling but through mirrors.
///
/// Russian roulette: survival probability sqrt(max throughput), clamped to [0.05, 1] (measured: less noise in
/// the same time than the throughput itself, or than after a fixed number of reflections); disabled for the
/// first bounce where direct light is zero (mirrors, shadow, planetshine).
///
/// Surviving paths of a batch are compacted after each bounce, so that packets stay full.
///
/// Rays between bodies have their origin relative to the body they leave, so that precision does not depend
/// on the distance from the camera. Thread-bound, as Tracer.
class PathTracer final : public Tracer {
public:
    PathTracer(const RowState& row, const Lighting& lighting, const scene::Sun& sun, RayCounts& counts);

    [[nodiscard]] std::size_t channels() const override { return lighting_.sun_w_m2.size(); }
    void radiance(std::span<CameraRays> batch) override;

private:
    struct Paths;
    struct Vertex;

    /// Transforms the rays of `paths` to the frame of `body`.
    void rays_in(const BodyState& body, const Paths& paths, RayPacket& rays) const;
    /// Takes from `left` the lanes whose hits lie in the same frame as its first lane's, evaluates their
    /// surfaces and adds their emission to `out`.
    void gather(const HitPacket& hits, Paths& paths, Lanes& left, Vertex& vertex, Channels& out) const;
    /// Adds emission at the hits, with its MIS weight. Paths that hit the Sun end.
    void add_emission(const BodyState& body, const Lanes& here, const SurfacePacket& surface,
                      const RayPacket& view, const HitPacket& hits, Paths& paths, Channels& out) const;
    /// Evaluates colours and textures: the factor on the reflectance, shading normals by the normal map.
    /// True if material parameters vary over the surface: they are in `varied`.
    bool colour(std::int32_t index, const Lanes& here, const HitPacket& hits, const Paths& paths,
                const RayPacket& view, SurfacePacket& surface, Channels& factor,
                ParameterPacket& varied) const;
    /// BRDF of each lane's material towards the viewer for light from `light`, 1/sr; 0 on mirrors.
    void reflectance(const Vertex& vertex, const Vec3s& light, Doubles& r) const;
    /// Next-event estimation: sample, evaluate the BRDF, trace shadow rays, add to `out`. `weighted`: with
    /// the MIS weight against BSDF sampling.
    void add_sun(const Vertex& vertex, const Doubles& u, const Doubles& v, const Paths& paths, Channels& out);
    void add_lamps(const Vertex& vertex, const Paths& paths, Channels& out);
    void add_area_light(const Vertex& vertex, const Doubles& u, const Doubles& v, const Paths& paths,
                        bool weighted, Channels& out);
    /// Samples the BSDF: next ray and throughput.
    void scatter(const Vertex& vertex, const Doubles& u, const Doubles& v, Paths& next) const;
    /// Adds emission and direct light at the hits to `out`, then sets the paths' next rays.
    void shade(std::uint32_t bounce, Paths& paths, Channels& out);
    /// Intersects the paths' rays with all bodies; paths that leave the scene end.
    void follow(Paths& paths);
    /// Moves the paths that are alive to the front; returns the number of packets that they fill.
    std::size_t compact(std::span<Paths> paths) const;
    /// Switches off blocked shadow rays. Towards the Sun only the known occluders of a body are tested,
    /// else (`all_bodies`) all.
    void block(const Vertex& vertex, bool all_bodies, RayPacket& light);

    const Lighting& lighting_;
};

} // namespace obscura::renderer
