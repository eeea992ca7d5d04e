// SPDX-License-Identifier: Apache-2.0
// Light of bodies in a frame, from traced samples, for the truth table.
#pragma once

#include "core/camera/region.hpp"
#include "core/geometry.hpp"
#include "renderer/camera/projection.hpp"
#include "renderer/integrators/tracer.hpp"
#include "renderer/packets/packet.hpp"
#include "renderer/world/row_state.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace obscura::renderer {

/// Light in each spectral band.
using BandLight = std::array<double, max_channels>;

/// Source of the light of bodies at an instant; the random numbers are the same for every call. Thread-bound.
class BodyLight {
public:
    virtual ~BodyLight() = default;
    /// Irradiance at the pupil, W/m2 times the transmission of the lens, of what lands on `sensor` and is
    /// seen. 0: unknown, with the camera within the body's bounding sphere.
    [[nodiscard]] virtual BandLight irradiance(std::size_t body, double time_s, const Region& sensor) = 0;
    /// Radiance that comes from a body along `direction` (unit, at rest, camera axes), W m-2 sr-1.
    [[nodiscard]] virtual BandLight radiance(std::size_t body, double time_s, Vec3 direction) = 0;
};

/// Samples of the disc of a body, and of a point of it.
constexpr std::uint32_t body_light_samples = 4096, point_light_samples = 64;

/// As BodyLight::irradiance(), in the channels and the unit of `tracer`. `candidates` is memory to work in.
void trace_irradiance(const RowState& row, std::int32_t body, const Projection& lens, const Region& sensor,
                      Tracer& tracer, std::vector<std::int32_t>& candidates, BandLight& light);
/// As BodyLight::radiance(), likewise.
void trace_radiance(const RowState& row, std::int32_t body, Vec3 direction, double ray_width_rad,
                    Tracer& tracer, std::vector<std::int32_t>& candidates, BandLight& light);

} // namespace obscura::renderer
