// From directions in the camera frame to radiance: the nearest body, and the Sun's light it returns.
#pragma once

#include "renderer/packet.hpp"
#include "renderer/row_state.hpp"

#include <cstdint>
#include <span>

namespace obscura::renderer {

/// Rays traced, by one thread.
struct RayCounts {
    std::uint64_t rays = 0;
    std::uint64_t samples = 0;
};

/// Traces packets of camera rays through the scene of one row. Not thread-safe: each thread has its own.
class Tracer {
public:
    /// `row` and `counts` must outlive the tracer.
    Tracer(const RowState& row, double sun_radius_m, RayCounts& counts);

    /// Nearest hits among `candidates` (indices of bodies) of rays from the camera along `direction` (unit,
    /// camera frame).
    void intersect(const Vec3s& direction, const Lanes& active, std::span<const std::int32_t> candidates,
                   HitPacket& hits);

    /// Radiance towards the camera at the hits, per irradiance of the Sun at 1 au (1/sr): emitted by the Sun,
    /// or reflected by the other bodies from one direction to the Sun's disc chosen by u, v. 0 where there is
    /// no hit.
    void radiance(const Vec3s& direction, const HitPacket& hits, const Doubles& u, const Doubles& v,
                  Doubles& radiance);

    void count_samples(const Lanes& active) { counts_.samples += static_cast<std::uint64_t>(active.count()); }

private:
    void reflect(std::int32_t body, const Vec3s& direction, const HitPacket& hits, const Doubles& u,
                 const Doubles& v, Doubles& radiance);

    const RowState& row_;
    double sun_radius_m_;
    double sun_radiance_;
    RayCounts& counts_;
};

} // namespace obscura::renderer
