// SPDX-License-Identifier: Apache-2.0
// Luminosity class of a star from its parallax, where its spectral type has none.
#pragma once

#include "ephemeris/stars/star.hpp"

namespace obscura::ephemeris {

/// Class of the absolute magnitude V + 5 + 5 log10(parallax in arc seconds): the nearest of dwarfs (V),
/// giants (III) and supergiants (Iab) of the spectral type or, where there is none, of B-V. Interstellar
/// extinction is not taken out. `parallax_error_mas`: one standard deviation; NaN where the catalogue gives
/// none, which counts as the 1 mas of Hipparcos. `unknown` if the parallax is below 5 of them, or neither
/// type nor B-V is known. Up to about G0 dwarfs and giants overlap: there the class is a guess. Reentrant.
[[nodiscard]] Luminosity luminosity_from_parallax(const CatalogueStar& star,
                                                  double parallax_error_mas = CatalogueStar::unknown);

} // namespace obscura::ephemeris
