// SPDX-License-Identifier: Apache-2.0
#include "core/pose_range.hpp"

#include <fmt/format.h>

namespace obscura {

std::optional<std::string> refusal_of_position(Vec3 position_m) {
    if (is_in_range(position_m)) return std::nullopt;
    return fmt::format("position: allowed are {0:g} to {1:g} m", -max_position_m, max_position_m);
}

std::optional<std::string> refusal_of_attitude(Quat orientation) {
    if (std::abs(norm(orientation) - 1) <= max_quaternion_error) return std::nullopt;
    return fmt::format("quaternion: a length of 1 within {:g} is wanted", max_quaternion_error);
}

std::optional<std::string> refusal_of_velocity(Vec3 velocity_m_s) {
    if (length(velocity_m_s) <= max_velocity_m_s) return std::nullopt;
    return fmt::format("velocity: allowed is up to {:g} m/s", max_velocity_m_s);
}

std::optional<std::string> refusal_of_rate(Vec3 rate_rad_s) {
    if (length(rate_rad_s) <= max_rate_rad_s) return std::nullopt;
    return fmt::format("rotation rate: allowed is up to {:g} rad/s", max_rate_rad_s);
}

std::optional<std::string> refusal_of(const Pose& pose) {
    if (auto why = refusal_of_position(pose.position_m)) return why;
    return refusal_of_attitude(pose.orientation);
}

} // namespace obscura
