// The lines that a simulator sends: poses with stamps, and steps. Described for people in docs/simulator.md.
#pragma once

#include "core/geometry.hpp"
#include "core/time.hpp"

#include <cstddef>
#include <string>
#include <string_view>
#include <variant>

namespace obscura::emulator {

/// `pose NAME TIME X Y Z QW QX QY QZ`
struct PoseLine {
    std::string_view name; ///< points into the line
    Time time;             ///< of the scene
    Pose pose;             ///< metres, inertial; the quaternion is normalised
};
/// `step TIME`
struct StepLine {
    Time time; ///< of the scene
};
/// `state`
struct StateLine {};
/// Anything else.
struct BadLine {
    std::string why; ///< one line, printable
};
using SimulatorLine = std::variant<PoseLine, StepLine, StateLine, BadLine>;

/// Longest line taken, without its end.
constexpr std::size_t simulator_line_bytes = 512;

/// Reads one line, without its end; every byte of it may be hostile.
[[nodiscard]] SimulatorLine parse_simulator_line(std::string_view line);

/// Seconds with up to nine decimals as nanoseconds, exactly; false unless it is such a number below 1e9.
[[nodiscard]] bool parse_seconds(std::string_view text, Time& time) noexcept;
/// The other way round: all nine decimals.
[[nodiscard]] std::string seconds_text(Time time);

} // namespace obscura::emulator
