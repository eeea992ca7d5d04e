// SPDX-License-Identifier: Apache-2.0
// Sky object: a star that moves or varies, a point of light in space with a phase law, or a galaxy.
#pragma once

#include "renderer/scene/scene.hpp"

#include <array>
#include <cstdint>
#include <string>
#include <vector>

namespace obscura::scene {

/// Planet whose published magnitude and phase law a point has: Mallama & Hilton, Computing apparent planetary
/// magnitudes for the Astronomical Almanac, Astron. Comput. 25, 10 (2018), without rotation, seasons and
/// Saturn's rings.
enum class Planet : std::uint8_t { none, mercury, venus, earth, mars, jupiter, saturn, uranus, neptune };
constexpr auto enum_names(Planet /*type*/) {
    return std::array{EnumName{Planet::none, "none"},      EnumName{Planet::mercury, "mercury"},
                      EnumName{Planet::venus, "venus"},    EnumName{Planet::earth, "earth"},
                      EnumName{Planet::mars, "mars"},      EnumName{Planet::jupiter, "jupiter"},
                      EnumName{Planet::saturn, "saturn"},  EnumName{Planet::uranus, "uranus"},
                      EnumName{Planet::neptune, "neptune"}};
}

/// Object of the sky beside bodies and catalogues. It is never traced: projected, hidden by bodies, and
/// spread by the PSF, as a star is.
struct SkyObject {
    enum class Kind : std::uint8_t {
        star,   ///< at a place on the sky, at infinity
        point,  ///< at a place in space, lit by the Sun
        galaxy, ///< an extended one at a place on the sky
    };
    std::string name;
    Kind kind = Kind::star;
    /// Place of a star or galaxy; mean V, colour and type. Of a point V is that at 1 au from Sun and camera,
    /// at phase angle 0.
    Star star;
    /// Apparent motion of a star from scene time 0 on: right ascension (times cos(declination)), declination.
    std::array<double, 2> rate_rad_s{0, 0};
    /// V varies by this times sin(2 pi (t / period + phase)).
    double amplitude_mag = 0, period_s = 1, phase = 0;

    // Members of a point:
    Motion motion;
    std::string parent;           ///< see Body::parent
    Planet planet = Planet::none; ///< instead of star.magnitude_v and phase_law_mag
    /// V increases by the sum of these times the powers 1, 2, ... of the phase angle in degrees.
    std::vector<double> phase_law_mag;

    // Members of a galaxy: Sersic's profile.
    double half_light_radius_rad = 0; ///< along the major axis
    double sersic_index = 1;          ///< 1: exponential disc, 4: de Vaucouleurs
    double axis_ratio = 1;            ///< minor over major axis
    double position_angle_rad = 0;    ///< of the major axis, from north over east

    /// Irradiance of a still star in each spectral band, W/m2, instead of magnitude, colour and type; empty:
    /// by those.
    std::vector<double> irradiance_w_m2{};

    std::string position; ///< see Body::position

    /// Whether it is as a star of a catalogue: does neither move nor vary.
    [[nodiscard]] bool still() const {
        return kind != Kind::point && amplitude_mag == 0 && rate_rad_s[0] == 0 && rate_rad_s[1] == 0;
    }
};
constexpr auto enum_names(SkyObject::Kind /*type*/) {
    using Kind = SkyObject::Kind;
    return std::array{EnumName{Kind::star, "star"}, EnumName{Kind::point, "point"},
                      EnumName{Kind::galaxy, "galaxy"}};
}

/// V of a point at 1 au from Sun and camera at a phase angle, without its variation.
[[nodiscard]] double phase_magnitude_v(const SkyObject& object, double phase_rad) noexcept;

/// B-V of a planet; NaN for Planet::none.
[[nodiscard]] double planet_colour_b_v(Planet planet) noexcept;

} // namespace obscura::scene
