// SPDX-License-Identifier: Apache-2.0
// Velocities of what has no derivative of its own: turns, joints, poses from outside.
#pragma once

#include "core/geometry.hpp"

namespace obscura::scene {

/// Derivative at `time_s` of the position `at_m(time_s)`, m/s, by a central difference over 0.1 s: short
/// compared with the sampling of a trajectory, long compared with the rounding of positions at 1 au.
template<typename Position>
[[nodiscard]] Vec3 differenced_velocity_m_s(const Position& at_m, double time_s) {
    constexpr double half_step_s = 0.05;
    return (at_m(time_s + half_step_s) - at_m(time_s - half_step_s)) / (2 * half_step_s);
}

} // namespace obscura::scene
