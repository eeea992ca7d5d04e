// SPDX-License-Identifier: Apache-2.0
// Range of poses and rates, wherever they come from: files, calls, protocols, kernels.
#pragma once

#include "core/geometry.hpp"

#include <optional>
#include <string>

namespace obscura {

/// Largest coordinate of a position, m: a tenth of a light year. Squares of distances stay far within a
/// double.
inline constexpr double max_position_m = 1e15;
/// Largest velocity, m/s: above that of light, for poses in a moving frame.
inline constexpr double max_velocity_m_s = 1e9;
/// Largest rate of rotation, rad/s.
inline constexpr double max_rate_rad_s = 1e4;
/// Largest difference of the length of a quaternion from 1.
inline constexpr double max_quaternion_error = 1e-3;

/// Whether each coordinate is a number in the range. Real-time safe.
[[nodiscard]] inline bool is_in_range(Vec3 position_m) noexcept {
    return std::abs(position_m.x) <= max_position_m && std::abs(position_m.y) <= max_position_m &&
           std::abs(position_m.z) <= max_position_m;
}

// Each returns what is refused and what is allowed, in one line; none: nothing is.
[[nodiscard]] std::optional<std::string> refusal_of_position(Vec3 position_m);
[[nodiscard]] std::optional<std::string> refusal_of_attitude(Quat orientation);
[[nodiscard]] std::optional<std::string> refusal_of_velocity(Vec3 velocity_m_s);
[[nodiscard]] std::optional<std::string> refusal_of_rate(Vec3 rate_rad_s);
/// That of the position, else that of the attitude.
[[nodiscard]] std::optional<std::string> refusal_of(const Pose& pose);

} // namespace obscura
