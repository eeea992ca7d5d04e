// SPDX-License-Identifier: Apache-2.0
// Header cards for the date of a picture (FITS standard 4.0, section 9).
#pragma once

#include "ephemeris/time/epoch.hpp"
#include "images/writers/card.hpp"

#include <optional>

namespace obscura::tools {

/// TIMESYS, DATE-OBS and MJD-OBS of the exposure's start, DATE-AVG and MJD-AVG of its middle, both seconds of
/// scene time after the scene's epoch; in UTC, before 1960 in TT. Empty: the scene has no epoch.
[[nodiscard]] images::Cards date_cards(const std::optional<ephemeris::Epoch>& epoch, double start_s,
                                       double middle_s);

} // namespace obscura::tools
