// SPDX-License-Identifier: Apache-2.0
// Path tracer: bounce loop with Russian roulette over packets of paths; direct light at each vertex.
#pragma once

#include "renderer/integrators/direct_light.hpp"
#include "renderer/integrators/path_packet.hpp"
#include "renderer/integrators/path_vertex.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/lights/lighting.hpp"

#include <cstdint>
#include <span>

namespace obscura::renderer {

/// Backward path tracer with next-event estimation: one channel per spectral band, radiance in W m-2 sr-1.
///
/// At each vertex: emission and direct light (DirectLight); then one BSDF-sampled direction.
///
/// Planetshine: at each vertex that has sunlit bodies for sources (BodyState::planetshine), a direction to
/// the lit part of each one's disc is sampled as well (LitDisc), and the direct sunlight where its ray hits
/// that body is combined by the balance heuristic with that found by the BSDF-sampled direction. It belongs
/// to the next bounce. Vertices in direct sunlight leave sources to chance that are too faint to matter
/// there.
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
    /// All arguments must outlive the tracer.
    PathTracer(const Instants& instants, const Lighting& lighting, const scene::Sun& sun, RayCounts& counts);

    [[nodiscard]] std::size_t channels() const override { return lighting_.sun_w_m2.size(); }
    [[nodiscard]] bool sunlight_only() const override;
    [[nodiscard]] double reference_radiance(const BodyState& body) const override;
    void radiance(std::span<CameraRays> batch) override;

private:
    /// Takes from `left` the lanes whose hits lie in the same frame as its first lane's, evaluates their
    /// surfaces and adds their emission to `emitted`, unless null.
    void gather(const HitPacket& hits, PathPacket& paths, Lanes& left, PathVertex& vertex,
                Channels* emitted) const;
    /// MIS weights of the direct sunlight at a vertex that BSDF sampling found. False: all 1.
    [[nodiscard]] bool sunlight_weights(const PathVertex& vertex, const PathPacket& paths,
                                        Doubles& weight) const;
    /// Adds the sunlight that the planetshine sources of each lane's body reflect to it; sets
    /// PathPacket::shone_on.
    void add_planetshine(std::uint32_t bounce, const PathVertex& vertex, PathPacket& paths, Channels& out);
    /// Source number `slot` of the body of a lane.
    [[nodiscard]] PlanetshineSource planetshine_source(const PathVertex& vertex, const PathPacket& paths,
                                                       int lane, std::size_t slot) const {
        return instants_.body(vertex.of[lane], paths.instant, lane).planetshine[slot];
    }
    /// Sets PathPacket::shone_on: where the sources matter beside the light in `out`.
    void choose_shone_on(const PathVertex& vertex, const Channels& out, PathPacket& paths) const;
    /// Samples the lit part of each lane's source: directions in the vertex's frame; inverse pdf 0: none.
    void sample_planetshine(const PathVertex& vertex, const PathPacket& paths, std::size_t slot,
                            const Lanes& active, const Doubles& u, const Doubles& v, Vec3s& light,
                            Doubles& inverse_pdf) const;
    /// Sets the rays of `probe` in those directions, and their throughput.
    void aim_at_planetshine(const PathVertex& vertex, const PathPacket& paths, const Lanes& active,
                            const Vec3s& light, const Doubles& inverse_pdf, PathPacket& probe) const;
    /// Adds the emission of body `index` at the hits `here`, by its emission map if it has one.
    void add_emission(std::int32_t index, const Lanes& here, const SurfacePacket& surface,
                      const RayPacket& view, const HitPacket& hits, PathPacket& paths,
                      Channels& emitted) const;
    /// Texture filter widths at the hits `here`: those of camera rays of the same path length.
    void ray_widths(const Lanes& here, const HitPacket& hits, const PathPacket& paths,
                    Doubles& width_m) const;
    /// Evaluates colours and textures: the factor on the reflectance, shading normals by the normal map.
    /// True if material parameters vary over the surface: they are in `varied`.
    bool colour(std::int32_t index, const Lanes& here, const HitPacket& hits, const PathPacket& paths,
                const RayPacket& view, SurfacePacket& surface, Channels& factor,
                ParameterPacket& varied) const;
    /// Adds emission and direct light at the hits to `out`, then sets the paths' next rays.
    void shade(std::uint32_t bounce, PathPacket& paths, Channels& out);
    /// Intersects the paths' rays with all bodies; paths that leave the scene end.
    void follow(PathPacket& paths);

    const Lighting& lighting_;
    DirectLight direct_light_;
    bool planetshine_; ///< some body has sources
};

} // namespace obscura::renderer
