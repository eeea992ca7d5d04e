// SPDX-License-Identifier: Apache-2.0
// Sampling of the Sun's disc, uniform in solid angle.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// Samples, for each position (body frame), a unit direction to a point of the visible cap of the sphere
/// `sun_m`, `radius_m`, from u, v in [0,1), uniformly in solid angle. The estimator's weight is the disc's
/// mean radiance times `solid_angle`: the solid angle of the cap, sr (0 inside the sphere), times the
/// radiance at the point over the mean, by the linear law of limb darkening.
void sample_sun(const Vec3s& position, Vec3 sun_m, const scene::Sun& sun, const Doubles& u, const Doubles& v,
                Vec3s& direction, Doubles& solid_angle_sr);

/// Radiance at a point of the disc over the mean of the disc, from the cosine of the emission angle there.
[[nodiscard]] inline double limb_factor(double limb_darkening, double mu) {
    return (1 - limb_darkening * (1 - mu)) / (1 - limb_darkening / 3);
}

/// Radiance of a uniform Sun per irradiance at 1 au, 1/sr.
[[nodiscard]] double sun_radiance_per_irradiance(double radius_m);

} // namespace obscura::renderer
