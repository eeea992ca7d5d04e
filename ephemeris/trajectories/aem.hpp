// SPDX-License-Identifier: Apache-2.0
// CCSDS Attitude Ephemeris Messages (AEM, CCSDS 504.0-B): attitude profiles in keyword = value notation.
#pragma once

#include "ephemeris/time/leap_seconds.hpp"
#include "ephemeris/trajectories/path_segment.hpp"

#include <filesystem>
#include <string>

namespace obscura::ephemeris {

/// Reads an AEM of version 1 or 2 in keyword = value notation: ATTITUDE_TYPE QUATERNION and EULER_ANGLE, both
/// also with /DERIVATIVE, /RATE or /ANGVEL, and SPIN. The scalar of quaternions stands where QUATERNION_TYPE
/// says (version 2: last); Euler angles are in the order of EULER_ROT_SEQ, each about an axis that those
/// before it have turned; the rates of EULER_ANGLE/RATE are not used. Types with nutation are refused.
///
/// The message's quaternion turns frame A into frame B (ATTITUDE_DIR = A2B, always so in version 2) or B into
/// A (B2A): components transform by its frame rotation. The result is the orientation of the object's frame
/// (SC_BODY..., INSTRUMENT... and the like, or the one that is not inertial) in the other, in the sense of
/// obscura::Quat. Interpolation LINEAR (slerp; also when none is stated) or LAGRANGE. Throws ConfigError
/// `file:line: what`.
[[nodiscard]] PathFile read_aem(const std::filesystem::path& file, const LeapSeconds& leap_seconds);
/// As read_aem(), from the content of a file; `name` is for messages.
[[nodiscard]] PathFile parse_aem(const std::string& text, const std::string& name,
                                 const LeapSeconds& leap_seconds);

} // namespace obscura::ephemeris
