// SPDX-License-Identifier: Apache-2.0
// Deep-space part of SDP4: Sun and Moon, and resonances with the Earth's rotation, of orbits of 225 min or
// more.
#pragma once

#include "ephemeris/segments/sgp4_elements.hpp"

#include <array>
#include <cstddef>

namespace obscura::ephemeris {

/// Perturbations of one orbit. Immutable, thread-safe, real-time safe. Source: see Sgp4.
class DeepSpace {
public:
    /// Mean elements at a time; angles in rad, mean motion in rad/min.
    struct Elements {
        double eccentricity = 0, inclination = 0, node = 0, perigee = 0, anomaly = 0, motion = 0;
    };
    /// Changes of elements by time.
    struct Rates {
        double anomaly = 0, perigee = 0, node = 0;
    };

    /// `motion` is that of Brouwer's theory, `rates` are those of the Earth's oblateness, rad/min.
    DeepSpace(const TwoLineElements& at_epoch, double ke, double motion, const Rates& rates) noexcept;

    /// Adds what Sun, Moon and resonances change in `minutes` since the epoch.
    void add_secular(double minutes, Elements& e) const noexcept;
    /// Adds the periodic terms of Sun and Moon.
    void add_periodic(double minutes, Elements& e) const noexcept;

private:
    /// Sun or Moon: amplitudes of the terms in its anomaly, and secular rates.
    struct Perturber {
        double anomaly = 0, motion = 0, eccentricity = 0; ///< mean anomaly at the epoch, rad/min
        /// Amplitudes of cosine and sine of the doubled longitude in eccentricity, inclination, mean anomaly,
        /// perigee and node.
        std::array<std::array<double, 2>, 5> amplitude{};
        double anomaly_once = 0, perigee_once = 0; ///< of the sine of the longitude
        std::array<double, 5> rate{};              ///< of the same elements, per minute
    };
    /// How the perturber's orbit lies, relative to the node of the satellite's.
    struct Plane {
        double cos_perigee, sin_perigee, cos_inclination, sin_inclination, cos_node, sin_node;
        double strength;
    };
    /// Term amplitude sin(longitude_factor * longitude + perigee_factor * perigee - phase) of a resonance.
    struct Term {
        double amplitude = 0;
        int perigee_factor = 0, longitude_factor = 1;
        double phase = 0;
    };
    enum class Resonance : unsigned char { none, day, half_day };

    void set_amplitudes(const Plane& plane, Perturber& body) const noexcept;
    void set_half_day_terms(double inverse_axis) noexcept;
    void set_day_terms(double inverse_axis) noexcept;
    void add_resonance(double minutes, Elements& e) const noexcept;

    TwoLineElements e_;
    double motion_ = 0;
    Rates rates_;
    Perturber sun_, moon_;
    double sidereal_rad_ = 0; ///< at the epoch
    Resonance resonance_ = Resonance::none;
    std::array<Term, 10> terms_{};
    std::size_t term_count_ = 0;
    double longitude_ = 0, longitude_rate_ = 0; ///< resonant longitude at the epoch; its rate less the motion
};

} // namespace obscura::ephemeris
