// SPDX-License-Identifier: Apache-2.0
// CCSDS Orbit Ephemeris Messages (OEM, CCSDS 502.0-B): trajectories in keyword = value notation.
#pragma once

#include "ephemeris/time/leap_seconds.hpp"
#include "ephemeris/trajectories/path_segment.hpp"

#include <filesystem>
#include <string>

namespace obscura::ephemeris {

/// Reads an OEM of version 1 to 3 in keyword = value notation. Positions become metres. Accelerations and
/// covariances are skipped. Interpolation is as stated, else cubic Hermite with the stated velocities. Time
/// systems UTC, TAI, TT, TDB and GPS. Throws ConfigError `file:line: what`.
[[nodiscard]] PathFile read_oem(const std::filesystem::path& file, const LeapSeconds& leap_seconds);
/// As read_oem(), from the content of a file; `name` is for messages.
[[nodiscard]] PathFile parse_oem(const std::string& text, const std::string& name,
                                 const LeapSeconds& leap_seconds);

} // namespace obscura::ephemeris
