// Directions towards the Sun's disc, sampled uniformly in solid angle.
#pragma once

#include "renderer/packet.hpp"

namespace obscura::renderer {

/// For each position (body frame) a unit direction to a point of the visible cap of the sphere `sun_m`,
/// `radius_m`, from u, v in [0,1), and the solid angle of that cap, sr (0 inside the sphere). Uniform in
/// solid angle: the radiance of the disc times the solid angle is the estimator's weight.
void sample_sun(const Vec3s& position, Vec3 sun_m, double radius_m, const Doubles& u, const Doubles& v,
                Vec3s& direction, Doubles& solid_angle_sr);

/// Radiance of a uniform Sun per irradiance at 1 au, 1/sr.
[[nodiscard]] double sun_radiance_per_irradiance(double radius_m);

} // namespace obscura::renderer
