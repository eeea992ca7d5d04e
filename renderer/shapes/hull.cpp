// SPDX-License-Identifier: Apache-2.0
#include "renderer/shapes/hull.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace obscura::renderer {
namespace {

/// Clips the interval [near, far] of each ray to the slab between two planes.
OBSCURA_VECTOR_CLONES
void clip(const RayPacket& rays, Vec3 axis, double least, double most, Doubles& near, Doubles& far) {
    for (int i = 0; i < packet_size; ++i) {
        const double at = axis.x * rays.origin.x[i] + axis.y * rays.origin.y[i] + axis.z * rays.origin.z[i];
        const double speed =
            axis.x * rays.direction.x[i] + axis.y * rays.direction.y[i] + axis.z * rays.direction.z[i];
        // Rays parallel to the slab give infinities of the right signs; on a plane NaN, which changes
        // nothing.
        const double a = (least - at) / speed;
        const double b = (most - at) / speed;
        const double first = a < b ? a : b;
        const double last = a < b ? b : a;
        near[i] = first > near[i] ? first : near[i];
        far[i] = last < far[i] ? last : far[i];
    }
}

} // namespace

Hull::Hull() {
    std::size_t n = 0;
    for (int x = -1; x <= 1; ++x)
        for (int y = -1; y <= 1; ++y)
            for (int z = -1; z <= 1; ++z) {
                // Keep one of each pair of opposite directions.
                if (9 * x + 3 * y + z <= 0) continue;
                axis_[n++] =
                    normalized(Vec3{static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
            }
    least_.fill(std::numeric_limits<double>::max());
    most_.fill(std::numeric_limits<double>::lowest());
}

void Hull::include(Vec3 point) {
    radius_ = std::max(radius_, length(point));
    for (std::size_t k = 0; k < axes; ++k) {
        const double at = dot(axis_[k], point);
        least_[k] = std::min(least_[k], at);
        most_[k] = std::max(most_[k], at);
    }
}

void Hull::cull(const RayPacket& rays, double slack_rad, Lanes& near) const {
    // A ray turned by a small angle lies within that angle times the distance of this one anywhere on the
    // mesh; add a margin for rounding.
    double farthest = 0;
    for (int i = 0; i < packet_size; ++i)
        farthest = std::max(farthest, length_squared(rays.origin.lane(i)));
    const double slack_m = (std::sqrt(farthest) + radius_) * (slack_rad + 1e-12);
    Doubles first;
    Doubles last;
    for (int i = 0; i < packet_size; ++i) {
        first[i] = 0;
        last[i] = no_hit;
    }
    for (std::size_t k = 0; k < axes; ++k)
        clip(rays, axis_[k], least_[k] - slack_m, most_[k] + slack_m, first, last);
    for (int i = 0; i < packet_size; ++i)
        near.on[i] = first[i] <= last[i] ? near.on[i] : 0;
}

} // namespace obscura::renderer
