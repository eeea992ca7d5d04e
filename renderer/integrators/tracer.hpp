// SPDX-License-Identifier: Apache-2.0
// Tracer interface; the direct-light tracer: nearest body and its reflection of sunlight.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/packets/sample_stream.hpp"
#include "renderer/world/instants.hpp"

#include <cstdint>
#include <span>

namespace obscura::renderer {

/// Ray and sample counts of one thread.
struct RayCounts {
    std::uint64_t rays = 0;
    std::uint64_t samples = 0;
};

/// 16 camera rays, their hits and their radiance.
struct CameraRays {
    Vec3s direction; ///< unit, camera frame
    HitPacket hits;
    Words index, light_seed; ///< see SampleStream
    Words instant;           ///< see Instants
    Doubles level_u;         ///< see RayPacket; set by Tracer::intersect() if the scene has terrain
    Channels radiance;
};

/// Cosines of the angles that a BRDF depends on, from unit vectors in one frame: `view` towards the surface,
/// `light` away from it.
void scatter_angles(const SurfacePacket& surface, const Vec3s& view, const Vec3s& light, ScatterPacket& s);

/// Traces packets of camera rays through the scene of one row, each at its own instant. The base class
/// computes direct sunlight only, for a white Sun of unit irradiance: its single channel is radiance per
/// irradiance of the Sun at 1 au, 1/sr. Thread-bound: one for each thread.
class Tracer {
public:
    /// All arguments must outlive the tracer.
    Tracer(const Instants& instants, const scene::Sun& sun, RayCounts& counts);
    virtual ~Tracer() = default;
    Tracer(const Tracer&) = delete;
    Tracer& operator=(const Tracer&) = delete;

    /// Nearest hits among `candidates` (indices of bodies) of rays from the camera along `direction` (unit,
    /// camera frame). Where all rays have the same instant, `instant` is not read.
    void intersect(const Vec3s& direction, const Lanes& active, std::span<const std::int32_t> candidates,
                   HitPacket& hits, const Words& instant = {});

    /// As above, for rays whose `index`, `light_seed` and `instant` are set: fills `hits` and `level_u`.
    void intersect(CameraRays& rays, const Lanes& active, std::span<const std::int32_t> candidates);

    [[nodiscard]] virtual std::size_t channels() const { return 1; }
    /// Whether bodies send nothing but direct sunlight.
    [[nodiscard]] virtual bool sunlight_only() const { return true; }

    /// Reference level of the error at a body, mean over the channels, in the unit of radiance(): see
    /// BodyState::reference_radiance.
    [[nodiscard]] virtual double reference_radiance(const BodyState& body) const {
        return body.reference_radiance;
    }

    /// Largest number of packets of one call of radiance().
    static constexpr std::size_t batch_size = 8;
    /// Radiance towards the camera at the hits: emitted by the Sun, or its light reflected once, from one
    /// direction to the Sun's disc. 0 where there is no hit. At most `batch_size` packets, whose results are
    /// independent of each other.
    virtual void radiance(std::span<CameraRays> batch);

    /// Sets the angular width of camera rays, for texture filtering: the angle between neighbouring samples.
    void set_ray_width(double ray_width_rad) { ray_width_rad_ = ray_width_rad; }

    void count_samples(const Lanes& active) { counts_.samples += static_cast<std::uint64_t>(active.count()); }

protected:
    /// Switches off the active shadow rays (frame of `body`, from `origin` at the end of camera rays of the
    /// length `path_m`) that `other` blocks.
    void occlude_by(std::int32_t body, std::int32_t other, const Words& instant, const Vec3s& origin,
                    const Doubles& path_m, RayPacket& rays);
    void intersect(const Vec3s& direction, const Lanes& active, std::span<const std::int32_t> candidates,
                   HitPacket& hits, const Words& instant, const Doubles* level_u);

    const Instants instants_;
    const RowState& row_; ///< the first of them: for what is the same at all
    const scene::Sun& sun_;
    double sun_radiance_;
    RayCounts& counts_;
    double ray_width_rad_ = 0;
    const bool terrain_; ///< whether any body has levels of detail

private:
    void reflect(std::int32_t body, const CameraRays& rays, const Doubles& u, const Doubles& v,
                 Doubles& radiance);
    /// Reflects what is kept of sunlight on the body's own surface; switches off those lanes of `left`.
    void reflect_kept(std::int32_t body, const CameraRays& rays, const RayPacket& view, const Doubles& u,
                      const Doubles& v, Lanes& left, Doubles& radiance);
};

} // namespace obscura::renderer
