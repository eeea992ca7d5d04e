// SPDX-License-Identifier: Apache-2.0
// Sampling of directions in the local frame of a surface (z along the normal) from two uniform numbers.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/vector_math.hpp"

#include <cmath>

namespace obscura::renderer {

/// Cosine-weighted direction: pdf cos(theta) / pi, 1/sr.
inline Vec3 cosine_hemisphere(double u, double v) {
    double s = 0;
    double c = 0;
    sincos_turn(v, s, c);
    const double radius = std::sqrt(u);
    return {radius * c, radius * s, std::sqrt(1 - u)};
}

/// Direction at an angle of cosine `cos_angle` to the unit vector `axis`; azimuth `turn` in [0,1), in full
/// turns.
inline Vec3 around(Vec3 axis, double cos_angle, double turn) {
    Vec3 a;
    Vec3 b;
    orthonormal_basis(axis, a, b);
    double s = 0;
    double c = 0;
    sincos_turn(turn, s, c);
    const double sine = std::sqrt(std::fmax(0.0, 1 - cos_angle * cos_angle));
    return a * (sine * c) + b * (sine * s) + axis * cos_angle;
}

} // namespace obscura::renderer
