// SPDX-License-Identifier: Apache-2.0
#include "renderer/lights/sunlight.hpp"

#include "core/solar_spectrum.hpp"
#include "renderer/packets/vector_math.hpp"

#include <cmath>
#include <numbers>

namespace obscura::renderer {
namespace {

OBSCURA_VECTOR_CLONES
void sample_cone(const Vec3s& position, Vec3 sun, double radius, double darkening, const Doubles& u,
                 const Doubles& v, Vec3s& direction, Doubles& solid_angle_sr) {
    for (int i = 0; i < packet_size; ++i) {
        const double x = sun.x - position.x.v[i];
        const double y = sun.y - position.y.v[i];
        const double z = sun.z - position.z.v[i];
        const double inverse = 1 / std::sqrt(x * x + y * y + z * z);
        const double ax = x * inverse;
        const double ay = y * inverse;
        const double az = z * inverse;
        const double sine = radius * inverse;
        const double sine2 = sine < 1 ? sine * sine : 1.0;
        // 1 - cos of the cone's half angle, without cancellation for a small Sun.
        const double one_minus_cos = sine2 / (1 + std::sqrt(1 - sine2));
        const double h = u.v[i] * one_minus_cos;
        const double sin_theta = std::sqrt(h * (2 - h));
        const double cos_theta = 1 - h;
        double sin_phi;
        double cos_phi;
        sincos_turn(v.v[i], sin_phi, cos_phi);
        // Basis about the axis: Duff et al., see orthonormal_basis().
        const double sign = az < 0 ? -1.0 : 1.0;
        const double a = -1.0 / (sign + az);
        const double b = ax * ay * a;
        const double s = sin_theta * cos_phi;
        const double t = sin_theta * sin_phi;
        direction.x.v[i] = ax * cos_theta + s * (1 + sign * ax * ax * a) + t * b;
        direction.y.v[i] = ay * cos_theta + s * (sign * b) + t * (sign + ay * ay * a);
        direction.z.v[i] = az * cos_theta - s * (sign * ax) - t * ay;
        // Sine of the emission angle at the surface: off-centre angle over the angle of the limb.
        const double mu2 = 1 - h * (2 - h) / sine2;
        const double mu = std::sqrt(mu2 > 0 ? mu2 : 0.0);
        solid_angle_sr.v[i] =
            sine < 1 ? 2 * std::numbers::pi * one_minus_cos * limb_factor(darkening, mu) : 0.0;
    }
}

} // namespace

void sample_sun(const Vec3s& position, Vec3 sun_m, const scene::Sun& sun, const Doubles& u, const Doubles& v,
                Vec3s& direction, Doubles& solid_angle_sr) {
    sample_cone(position, sun_m, sun.radius_m, sun.limb_darkening, u, v, direction, solid_angle_sr);
}

double sun_radiance_per_irradiance(double radius_m) {
    // The irradiance of a uniform disc on a plane facing its centre is pi L sin^2.
    return astronomical_unit_m * astronomical_unit_m / (std::numbers::pi * radius_m * radius_m);
}

} // namespace obscura::renderer
