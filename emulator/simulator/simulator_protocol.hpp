// SPDX-License-Identifier: Apache-2.0
// Line protocol of the simulator port: time-stamped poses, steps, state queries. Manual: docs/simulator.md.
#pragma once

#include "core/geometry.hpp"
#include "core/time.hpp"
#include "emulator/render/pose_ring.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

namespace obscura::emulator {

/// `pose NAME TIME X Y Z QW QX QY QZ [VX VY VZ WX WY WZ]`
struct PoseLine {
    std::string_view name; ///< points into the line
    Time time;             ///< scene time
    Pose pose;             ///< metres, inertial; the quaternion is normalised
    std::optional<PoseRates> rates{};
};
/// `step TIME`
struct StepLine {
    Time time; ///< scene time
};
/// `state`
struct StateLine {};
/// `token PROOF`
struct TokenLine {
    std::string_view proof; ///< points into the line
};
/// Anything else.
struct BadLine {
    std::string why; ///< one line, printable
};
using SimulatorLine = std::variant<PoseLine, StepLine, StateLine, TokenLine, BadLine>;

/// Longest line accepted, without its end.
constexpr std::size_t simulator_line_bytes = 512;

/// Parses one line, without its end. The input is untrusted.
[[nodiscard]] SimulatorLine parse_simulator_line(std::string_view line);

/// Checks the values of a pose and gives its quaternion a length of 1. Returns empty, or the reason why they
/// are refused.
[[nodiscard]] std::string check_pose(PoseLine& pose);

/// Parses seconds with up to nine decimals exactly; returns false unless `text` is such a number below 1e9.
[[nodiscard]] bool parse_seconds(std::string_view text, Time& time) noexcept;
/// Formats `time` as seconds with nine decimals.
[[nodiscard]] std::string seconds_text(Time time);

} // namespace obscura::emulator
