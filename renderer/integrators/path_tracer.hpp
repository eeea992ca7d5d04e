// Light of every kind, over any number of reflections.
#pragma once

#include "renderer/integrators/tracer.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// What a scene shines with, and how far its light is followed; the same for all rows.
struct Lighting {
    std::vector<double> sun_w_m2; ///< per band at 1 au; all 0: no Sun
    std::vector<scene::Lamp> lamps;
    std::vector<std::int32_t> area_lights; ///< bodies that emit and whose area can be sampled
    double area_m2 = 0;                    ///< of those together
    std::uint32_t max_bounces = 0;

    [[nodiscard]] bool has_sun() const;
};

[[nodiscard]] Lighting make_lighting(const scene::Scene& scene, const std::vector<BuiltBody>& bodies,
                                     std::vector<double> sun_w_m2, std::uint32_t max_bounces);

/// A backward path tracer: one channel per spectral band, radiance in W m-2 sr-1.
///
/// At each hit it adds what the surface emits, then the light that arrives directly from the Sun's disc, each
/// lamp, and one point of the emitting bodies (next-event estimation), and follows one direction drawn from
/// the scattering law. Emission that such a direction meets by chance is weighted against the drawing of
/// light points by the balance heuristic (Veach, Robust Monte Carlo Methods for Light Transport Simulation,
/// 1997, ch. 9). Paths go on with the root of what they still carry as their chance (measured: less noise in
/// the same time than in proportion to it, or than after certain reflections); but the first reflection is
/// always followed from places that no light reaches directly, where it is all there is: mirrors, shadows,
/// planetshine. The Sun is met by chance only through mirrors.
///
/// Paths that end leave lanes free: the others of a batch move together, so that packets stay full.
///
/// Rays between bodies are kept relative to the body they leave, so that no precision is lost at any distance
/// from the camera.
class PathTracer final : public Tracer {
public:
    PathTracer(const RowState& row, const Lighting& lighting, const scene::Sun& sun, RayCounts& counts);

    [[nodiscard]] std::size_t channels() const override { return lighting_.sun_w_m2.size(); }
    void radiance(std::span<CameraRays> batch) override;

private:
    struct Paths;
    struct Vertex;

    /// The rays of the paths in the frame of `body`.
    void rays_in(const BodyState& body, const Paths& paths, RayPacket& rays) const;
    /// Takes from `left` the lanes whose hits are in the frame of the first of them, and finds their
    /// surfaces.
    void gather(const HitPacket& hits, Paths& paths, Lanes& left, Vertex& vertex, Channels& out) const;
    void meet_light(const BodyState& body, const Lanes& here, const SurfacePacket& surface,
                    const RayPacket& view, const HitPacket& hits, Paths& paths, Channels& out) const;
    /// What the body's colours and textures multiply its reflectance by; turns normals by its normal map.
    /// True when its material's parameters differ: they are in `varied`.
    bool colour(std::int32_t index, const Lanes& here, const HitPacket& hits, const Paths& paths,
                const RayPacket& view, SurfacePacket& surface, Channels& factor,
                ParameterPacket& varied) const;
    /// The reflectance of each lane's material towards the viewer for light from `light`; 0 on mirrors.
    void reflectance(const Vertex& vertex, const Vec3s& light, Doubles& r) const;
    void add_sun(const Vertex& vertex, const Doubles& u, const Doubles& v, const Paths& paths, Channels& out);
    void add_lamps(const Vertex& vertex, const Paths& paths, Channels& out);
    void add_area_light(const Vertex& vertex, const Doubles& u, const Doubles& v, const Paths& paths,
                        bool weighted, Channels& out);
    void scatter(const Vertex& vertex, const Doubles& u, const Doubles& v, Paths& next) const;
    /// Adds to `out` what the surfaces met by the paths send back, and turns the paths to their next
    /// direction.
    void shade(std::uint32_t bounce, Paths& paths, Channels& out);
    /// The nearest surfaces on the paths' ways.
    void follow(Paths& paths);
    /// Moves the paths that are alive together; the number of packets that they fill.
    std::size_t compact(std::span<Paths> paths) const;
    /// Switches off the rays towards light that are blocked, by any body or (Sun) by those that can.
    void block(const Vertex& vertex, bool all_bodies, RayPacket& light);

    const Lighting& lighting_;
};

} // namespace obscura::renderer
