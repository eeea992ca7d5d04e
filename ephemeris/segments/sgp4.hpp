// SPDX-License-Identifier: Apache-2.0
// SGP4 and SDP4: motion of satellites by two-line elements, near Earth and in deep space.
#pragma once

#include "ephemeris/segments/sgp4_deep_space.hpp"
#include "ephemeris/segments/sgp4_elements.hpp"
#include "ephemeris/segments/two_body.hpp"

#include <optional>

namespace obscura::ephemeris {

/// Orbit of one set of elements. Positions are in the true equator and mean equinox of date (TEME).
/// Immutable, thread-safe, real-time safe. Source: Hoots and Roehrich (1980), Spacetrack Report No. 3, with
/// the corrections of Vallado, Crawford, Hujsak and Kelso (2006), AIAA 2006-6753, in the mode of the Air
/// Force, which SPICE has too; sidereal time and the node's quadrant are its only differences.
class Sgp4 {
public:
    Sgp4(const Sgp4Constants& constants, const TwoLineElements& elements) noexcept;

    /// State at a time after the epoch of the elements. False: the elements do not describe an orbit then, or
    /// it is below the surface.
    [[nodiscard]] bool propagate(double minutes, StateKm& state) const noexcept;

private:
    /// Mean elements at a time.
    using Elements = DeepSpace::Elements;

    void set_rates(double semi_latus) noexcept;
    void set_drag(double semi_major) noexcept;
    /// Elements after secular changes; `anomaly` is that before its drag, which is `drag_rad` in longitude.
    [[nodiscard]] Elements secular(double t, double& shrinkage, double& eccentricity_loss,
                                   double& drag_rad) const noexcept;
    [[nodiscard]] bool state_of(const Elements& e, double semi_major, StateKm& state) const noexcept;

    Sgp4Constants c_;
    TwoLineElements e_;
    double motion_ = 0; ///< mean motion of Brouwer's theory, rad/min
    double anomaly_rate_ = 0, perigee_rate_ = 0, node_rate_ = 0;
    /// Coefficients of drag, of the powers of time in semi-major axis, eccentricity and longitude.
    double c1_ = 0, c4_ = 0, c5_ = 0, d2_ = 0, d3_ = 0, d4_ = 0;
    double longitude_[4] = {}; ///< of t^2 to t^5
    double node_drag_ = 0, perigee_drag_ = 0, anomaly_drag_ = 0, eta_ = 0;
    bool simple_drag_ = false; ///< the perigee is low, or it is deep space
    std::optional<DeepSpace> deep_;
};

} // namespace obscura::ephemeris
