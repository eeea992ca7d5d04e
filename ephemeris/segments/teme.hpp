// SPDX-License-Identifier: Apache-2.0
// True equator and mean equinox of date (TEME), the frame of two-line elements.
#pragma once

#include "core/geometry.hpp"
#include "ephemeris/segments/two_body.hpp"
#include "ephemeris/time/epoch.hpp"

namespace obscura::ephemeris {

/// Rotation of vectors from TEME to J2000, by the precession of 1976 and the nutation of 1980 of the IAU; the
/// equinoxes differ by the nutation in longitude times the cosine of the mean obliquity. Real-time safe.
/// Source: Vallado, Crawford, Hujsak and Kelso (2006), AIAA 2006-6753, appendix C.
[[nodiscard]] Mat3 teme_to_j2000(TdbTime time) noexcept;
/// The same of a state, with the rate of the rotation.
[[nodiscard]] StateKm teme_to_j2000(TdbTime time, const StateKm& state) noexcept;

} // namespace obscura::ephemeris
