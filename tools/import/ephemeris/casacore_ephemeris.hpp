// SPDX-License-Identifier: Apache-2.0
// JPL's planetary ephemeris DE405 from the table of Debian's package casacore-data-jpl-de405.
#pragma once

#include "ephemeris/kernels/daf_writer.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace obscura::tools {

/// Where that package puts the table.
inline constexpr const char* casacore_de405 = "/usr/share/casacore/data/ephemerides/DE405";

/// Segments of an SPK kernel, type 2, made of a casacore table: the solar system barycentre (0) to the
/// barycentres of the planets (1 to 9) and the Sun (10), the Earth-Moon barycentre (3) to Moon (301) and
/// Earth (399), and Mercury (199) and Venus (299) at their barycentres. Coefficients are copied, those of
/// Moon and Earth scaled by the mass ratio.
struct CasacoreEphemeris {
    std::string name; ///< "JPL Planetary ephemeris DE405"
    std::vector<ephemeris::DafArrayData> segments;
};

/// Reads the table in `folder`. Throws InputError if it is another table, or damaged.
[[nodiscard]] CasacoreEphemeris read_casacore_ephemeris(const std::filesystem::path& folder);

} // namespace obscura::tools
