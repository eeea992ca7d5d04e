// SPDX-License-Identifier: Apache-2.0
// Where an observer sees a body: light time, stellar aberration, deflection of light by the Sun.
#pragma once

#include "ephemeris/kernels/ephemeris.hpp"

namespace obscura::ephemeris {

/// Corrections from the geometric place to the apparent one, each on its own.
struct Corrections {
    /// The target is taken when the light left it, iterated until that time settles within a nanosecond
    /// (SPICE's "CN").
    bool light_time = false;
    /// The direction is turned for the velocity of the observer relative to the solar system barycentre,
    /// by special relativity (SPICE's "+S" is the same to first order).
    bool aberration = false;
    /// Light is bent by the Sun's gravity, 4.1 mas at right angles to the Sun 1 au from it; needs positions
    /// of the Sun.
    bool sun_deflection = false;
};

/// Where an observer sees a target.
struct Place {
    /// Relative to the observer, ICRF axes: the corrected direction, of the length of the distance.
    Vec3 position_m{};
    /// As position_m, of the straight line to where the target was: neither aberration nor deflection.
    Vec3 straight_m{};
    /// Target when the light left it relative to the observer now: not turned.
    Vec3 velocity_m_s{};
    double light_time_s = 0;
    TdbTime seen_at{}; ///< instant at which the target is taken; without light time: now
};

/// Place of `target` seen from the centre of `observer` at `time`. Throws InputError with what is not
/// covered.
[[nodiscard]] Place apparent_place(const Ephemeris& kernels, int target, int observer, TdbTime time,
                                   Corrections corrections);

/// Direction of light from `source_m` to an observer, bent by the Sun; positions from the observer, m. The
/// first-order formula of general relativity for sources at any distance, as ERFA's `eraLd`.
[[nodiscard]] Vec3 deflected_by_sun(Vec3 source_m, Vec3 sun_m) noexcept;
/// As deflected_by_sun(), of a source at infinite distance in the unit vector `direction`; unit.
[[nodiscard]] Vec3 starlight_deflected_by_sun(Vec3 direction, Vec3 sun_m) noexcept;

/// A point of a body's surface, planetocentric.
struct SurfacePoint {
    double longitude_rad = 0; ///< east, 0 to 2 pi
    double latitude_rad = 0;
};
/// Longitude and latitude of a direction in body-fixed axes.
[[nodiscard]] SurfacePoint surface_point(Vec3 direction) noexcept;

} // namespace obscura::ephemeris
