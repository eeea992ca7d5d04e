// SPDX-License-Identifier: Apache-2.0
#include "renderer/camera/aberration.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace obscura::renderer {

Vec3 aberrate(Vec3 d, Vec3 beta) {
    const double inverse_gamma = std::sqrt(1 - dot(beta, beta));
    const double along = dot(d, beta);
    return normalized(inverse_gamma * d + (1 + along / (1 + inverse_gamma)) * beta);
}

void MovingLens::rays(const Doubles& x, const Doubles& y, Vec3s& direction, Doubles& weight_sr) const {
    lens_.rays(x, y, direction, weight_sr);
    for (int i = 0; i < packet_size; ++i)
        direction.set(i, aberrate(direction.lane(i), -1.0 * beta_));
}

std::optional<ImagePoint> MovingLens::project(Vec3 direction) const {
    return lens_.project(aberrate(normalized(direction), beta_));
}

double MovingLens::transmission(Vec3 direction) const {
    return lens_.transmission(aberrate(normalized(direction), beta_));
}

double MovingLens::pixel_angle_rad() const {
    return lens_.pixel_angle_rad() * (1 + 2 * length(beta_));
}

double MovingLens::local_pixel_angle_rad(Vec3 direction) const {
    return lens_.local_pixel_angle_rad(aberrate(normalized(direction), beta_));
}

double MovingLens::field_angle_rad(double margin_px) const {
    return std::min(lens_.field_angle_rad(margin_px) + 2 * length(beta_), std::numbers::pi);
}

} // namespace obscura::renderer
