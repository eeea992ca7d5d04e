// SPDX-License-Identifier: Apache-2.0
// Umbra of a planet: where its least sphere alone hides the whole disc of the Sun.
#pragma once

#include "core/geometry.hpp"
#include "renderer/packets/packet.hpp"

#include <algorithm>
#include <cmath>

namespace obscura::renderer {

/// In scaled space, where the reference surface is the unit sphere. All between the least and the largest
/// sphere within a cone about the direction away from the Sun is dark: a point at distance r from the centre
/// sees the least sphere, of radius l, within asin(l / r) of the centre, and the Sun within a small angle of
/// its direction.
class Umbra {
public:
    /// `sun_radius`: at least that of the disc in any direction; `least`, `largest`: unit heights.
    Umbra(Vec3 sun, double sun_radius, double least, double largest)
        : away_(-1 / length(sun) * sun),
          inner2_((1 + least) * (1 + least)),
          outer2_((1 + largest) * (1 + largest)) {
        // The disc's half angle, parallax, and what the Sun may be from the one that visibility was kept for.
        constexpr double slack_rad = 0.005;
        const double distance = length(sun) - (1 + largest);
        if (!(distance > 10 * (1 + largest)) || !(least > -0.5)) return;
        const double sun_rad = std::asin(std::min(1.0, sun_radius / distance)) + (1 + largest) / distance;
        const double angle = std::asin((1 + least) / (1 + largest)) - sun_rad - slack_rad;
        if (angle > 0) cos_angle_ = std::cos(angle);
    }
    [[nodiscard]] bool exists() const { return cos_angle_ < 1; }

    /// Where the ray enters the least sphere, if all of it between the largest sphere, or its origin, and
    /// there is dark; else no_hit. The cone is convex: its ends tell. `direction`: any length above 0.
    [[nodiscard]] double dark_entry(Vec3 origin, Vec3 direction) const {
        const double speed2 = length_squared(direction), along = dot(origin, direction);
        const double height2 = length_squared(origin);
        const double inner = along * along - speed2 * (height2 - inner2_);
        if (!(along < 0) || !(inner > 0) || !(height2 > inner2_)) return no_hit;
        const double outer = along * along - speed2 * (height2 - outer2_);
        const double in = (-along - std::sqrt(inner)) / speed2;
        const double begin = std::max(0.0, (-along - std::sqrt(outer)) / speed2);
        return dark(origin + begin * direction) && dark(origin + in * direction) ? in : no_hit;
    }

private:
    [[nodiscard]] bool dark(Vec3 p) const { return dot(p, away_) > cos_angle_ * length(p); }

    Vec3 away_;
    double inner2_, outer2_;
    double cos_angle_ = 1;
};

} // namespace obscura::renderer
