// SPDX-License-Identifier: Apache-2.0
// Two-body motion: propagation by universal variables, equinoctial elements.
#pragma once

#include "core/geometry.hpp"

namespace obscura::ephemeris {

/// Position, km, and velocity, km/s.
struct StateKm {
    Vec3 position{}, velocity{};
};

/// Goes over from `early` to `late` within `span_s`, `after_s` from its beginning, by weights of a cosine;
/// the velocity is the derivative of the position. Real-time safe. Source: NAIF, SPK Required Reading, types
/// 5, 10.
[[nodiscard]] StateKm blended_states(const StateKm& early, const StateKm& late, double after_s,
                                     double span_s) noexcept;

/// State `dt_s` after `from` about a centre of `gm` km3/s2, on an ellipse, parabola or hyperbola. False: no
/// orbit (a zero radius, values that are not finite). Real-time safe. Source: Bate, Mueller and White (1971),
/// Fundamentals of Astrodynamics, section 4.4, solved with Newton's method between bounds.
[[nodiscard]] bool propagate_two_body(double gm, const StateKm& from, double dt_s, StateKm& to) noexcept;

/// Equinoctial elements with constant rates of node and periapsis, as in SPK type 17; angles in rad.
struct EquinoctialElements {
    double semi_major_axis_km = 0;
    double h = 0, k = 0; ///< eccentricity times sine and cosine of the longitude of periapsis
    double mean_longitude = 0;
    double p = 0, q = 0; ///< tangent of half the inclination times sine and cosine of the node
    double periapsis_rate = 0, mean_longitude_rate = 0, node_rate = 0; ///< rad/s
    double pole_ra = 0, pole_dec = 0;                                  ///< of the plane they refer to
};
/// State `dt_s` after the epoch of the elements. Real-time safe. Source: Broucke and Cefola (1972), Celestial
/// Mechanics 5, 303, with the tangent form of p and q.
[[nodiscard]] StateKm equinoctial_state(const EquinoctialElements& elements, double dt_s) noexcept;

} // namespace obscura::ephemeris
