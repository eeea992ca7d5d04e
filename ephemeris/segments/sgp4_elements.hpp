// SPDX-License-Identifier: Apache-2.0
// Two-line elements and the constants of the Earth that SGP4 goes by.
#pragma once

#include <numbers>

namespace obscura::ephemeris {

inline constexpr double full_turn_rad = 2 * std::numbers::pi;

/// As in SPK type 10; the unit of length is the Earth's radius (AE = 1).
struct Sgp4Constants {
    double j2 = 0, j3 = 0, j4 = 0;
    double ke = 0;                  ///< sqrt(GM), radii^1.5 per minute
    double top_km = 0, base_km = 0; ///< heights QO and SO of the model of the atmosphere
    double radius_km = 0;
};

/// Mean elements at their epoch; angles in rad.
struct TwoLineElements {
    double bstar = 0; ///< drag term, per radius of the Earth
    double inclination = 0, node = 0, eccentricity = 0, perigee = 0, anomaly = 0;
    double motion = 0;     ///< mean motion of Kozai's theory, rad/min
    double epoch_days = 0; ///< UTC, days since 1949-12-31T00:00
};

} // namespace obscura::ephemeris
