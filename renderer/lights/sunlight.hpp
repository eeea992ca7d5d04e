// SPDX-License-Identifier: Apache-2.0
// Directions towards the Sun's disc, sampled uniformly in solid angle.
#pragma once

#include "renderer/packets/packet.hpp"
#include "renderer/scene/scene.hpp"

namespace obscura::renderer {

/// For each position (body frame) a unit direction to a point of the visible cap of the sphere `sun_m`,
/// `radius_m`, from u, v in [0,1), and the solid angle of that cap, sr (0 inside the sphere). Uniform in
/// solid angle: the disc's mean radiance times the solid angle is the estimator's weight. The solid angle is
/// that of the cap times the radiance at the point over the mean, by the linear law of limb darkening.
void sample_sun(const Vec3s& position, Vec3 sun_m, const scene::Sun& sun, const Doubles& u, const Doubles& v,
                Vec3s& direction, Doubles& solid_angle_sr);

/// Radiance at a point of the disc over the disc's mean, from the cosine of the angle to the surface there.
[[nodiscard]] inline double limb_factor(double limb_darkening, double mu) {
    return (1 - limb_darkening * (1 - mu)) / (1 - limb_darkening / 3);
}

/// Radiance of a uniform Sun per irradiance at 1 au, 1/sr.
[[nodiscard]] double sun_radiance_per_irradiance(double radius_m);

} // namespace obscura::renderer
