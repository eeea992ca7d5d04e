// SPDX-License-Identifier: Apache-2.0
#include "ephemeris/kernels/apparent_place.hpp"

#include <erfa.h>
#include <erfam.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace obscura::ephemeris {
namespace {

constexpr double light_speed_m_s = 299'792'458.0;
constexpr int sun = 10;

/// The unit vector `direction` of light, bent by the Sun at the distance `sun_m`; the other vectors are unit
/// ones too.
Vec3 bent(Vec3 direction, Vec3 sun_to_source, Vec3 sun_to_observer, double sun_m) noexcept {
    const auto numbers = [](Vec3 v) { return std::array{v.x, v.y, v.z}; };
    std::array<double, 3> p = numbers(direction), q = numbers(sun_to_source), e = numbers(sun_to_observer);
    std::array<double, 3> out{};
    // As in eraLdsun: beyond 1 au the limit, inside the solar disc, falls with the square of the distance.
    const double sun_au = sun_m / ERFA_DAU;
    const double limit = 1e-6 / std::max(1.0, sun_au * sun_au);
    eraLd(1, p.data(), q.data(), e.data(), sun_au, limit, out.data());
    return normalized(Vec3{out[0], out[1], out[2]});
}

} // namespace

Vec3 deflected_by_sun(Vec3 source_m, Vec3 sun_m) noexcept {
    const Vec3 from_sun = source_m - sun_m;
    const double distance = length(source_m), sun_distance = length(sun_m);
    const double source_distance = length(from_sun);
    if (!(distance > 0 && sun_distance > 0 && source_distance > 0)) return source_m;
    return bent(source_m / distance, from_sun / source_distance, sun_m / -sun_distance, sun_distance) *
           distance;
}

Vec3 starlight_deflected_by_sun(Vec3 direction, Vec3 sun_m) noexcept {
    const double sun_distance = length(sun_m);
    if (!(sun_distance > 0)) return direction;
    return bent(direction, direction, sun_m / -sun_distance, sun_distance);
}

Place apparent_place(const Ephemeris& kernels, int target, int observer, TdbTime time,
                     Corrections corrections) {
    Place place;
    place.seen_at = time;
    if (!corrections.light_time && !corrections.aberration) {
        const State state = kernels.state(target, observer, time);
        place.position_m = state.position_m;
        place.velocity_m_s = state.velocity_m_s;
    } else {
        // In the frame of the barycentre, in which light is straight.
        const State own = kernels.state(observer, solar_system_barycenter, time);
        State state = kernels.state(target, solar_system_barycenter, time);
        if (corrections.light_time) {
            constexpr double settled_s = 1e-9;
            constexpr int max_steps = 20;
            double seen_s = 0;
            for (int step = 0; step < max_steps; ++step) {
                const double next_s = -length(state.position_m - own.position_m) / light_speed_m_s;
                const bool settled = std::abs(next_s - seen_s) < settled_s;
                seen_s = next_s;
                if (settled) break;
                place.seen_at = time + seen_s;
                state = kernels.state(target, solar_system_barycenter, place.seen_at);
            }
        }
        place.position_m = state.position_m - own.position_m;
        place.velocity_m_s = state.velocity_m_s - own.velocity_m_s;
    }
    place.straight_m = place.position_m;
    place.light_time_s = length(place.position_m) / light_speed_m_s;
    const double distance = length(place.position_m);
    if (!(distance > 0)) return place;

    if (corrections.sun_deflection && target != sun && observer != sun) {
        const State at_sun = kernels.state(sun, observer, time);
        place.position_m = deflected_by_sun(place.position_m, at_sun.position_m);
    }
    if (corrections.aberration) {
        const Vec3 beta =
            kernels.state(observer, solar_system_barycenter, time).velocity_m_s / light_speed_m_s;
        const Vec3 d = place.position_m / distance;
        // The component along the motion is cos t' = (cos t + beta) / (1 + beta cos t).
        const double inverse_gamma = std::sqrt(1 - dot(beta, beta));
        const Vec3 turned = inverse_gamma * d + (1 + dot(d, beta) / (1 + inverse_gamma)) * beta;
        place.position_m = normalized(turned) * distance;
    }
    return place;
}

SurfacePoint surface_point(Vec3 direction) noexcept {
    const double longitude = std::atan2(direction.y, direction.x);
    return {longitude < 0 ? longitude + 2 * std::numbers::pi : longitude,
            std::atan2(direction.z, std::hypot(direction.x, direction.y))};
}

} // namespace obscura::ephemeris
