// SPDX-License-Identifier: Apache-2.0
// Star of a catalogue: place, motion, parallax, magnitude, colour, spectral type and identifier.
#pragma once

#include "core/geometry.hpp"
#include "core/text/enum_names.hpp"

#include <array>
#include <cstdint>
#include <limits>

namespace obscura::ephemeris {

/// Catalogue that numbers a star.
enum class StarIds : std::uint8_t {
    running,      ///< place in the file that it was read from, from 1
    hipparcos,    ///< HIP
    tycho,        ///< TYC, as tycho_id()
    gaia,         ///< Gaia source_id
    henry_draper, ///< HD
};
constexpr auto enum_names(StarIds /*type*/) {
    return std::array{EnumName{StarIds::running, "no"}, EnumName{StarIds::hipparcos, "HIP"},
                      EnumName{StarIds::tycho, "TYC"}, EnumName{StarIds::gaia, "Gaia"},
                      EnumName{StarIds::henry_draper, "HD"}};
}

/// Number of the star TYC `region`-`number`-`component`.
constexpr std::uint64_t tycho_id(std::uint64_t region, std::uint64_t number, std::uint64_t component) {
    return (region * 100'000 + number) * 10 + component;
}

/// Luminosity class.
enum class Luminosity : std::uint8_t {
    unknown,
    dwarf,      ///< IV and V
    giant,      ///< II and III
    supergiant, ///< I
};

/// Star at J2000.0, as seen from the solar system's barycentre.
struct CatalogueStar {
    Vec3 direction{1, 0, 0};      ///< unit, ICRF axes
    double motion_ra_mas_yr = 0;  ///< proper motion in right ascension times cos(declination)
    double motion_dec_mas_yr = 0; ///< in declination
    double parallax_mas = 0;      ///< 0: none known
    double magnitude_v = 0;       ///< Johnson V
    double colour_b_v = unknown;  ///< Johnson B-V; NaN: not known
    double type_number = unknown; ///< O, B, A, F, G, K, M are 0 to 6, the subclass is a tenth:
                                  ///< G2 is 4.2; NaN: not known
    Luminosity luminosity = Luminosity::unknown;
    StarIds ids = StarIds::running;
    std::uint64_t id = 0;

    static constexpr double unknown = std::numeric_limits<double>::quiet_NaN();
};

/// Unit vector of a right ascension and declination.
[[nodiscard]] Vec3 direction_of(double right_ascension_rad, double declination_rad);

/// Proper motion of a star as a vector across its direction, radians per Julian year, ICRF axes.
[[nodiscard]] Vec3 proper_motion(const CatalogueStar& star) noexcept;

/// Unit direction of a star `years` (Julian) after J2000.0 for an observer at `observer_au` from the solar
/// system's barycentre, ICRF axes: uniform space motion without radial velocity, The Hipparcos and Tycho
/// Catalogues, ESA SP-1200 (1997), vol. 1, eqs. 1.2.16 and 1.5.62. Without aberration. Real-time safe.
[[nodiscard]] Vec3 direction_at(const CatalogueStar& star, double years, Vec3 observer_au) noexcept;

} // namespace obscura::ephemeris
