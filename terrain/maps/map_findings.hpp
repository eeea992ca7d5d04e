// SPDX-License-Identifier: Apache-2.0
// What was found when a map was opened: its range, edges and assumptions, and signs of common mistakes.
#pragma once

#include "terrain/geometry/map_frame.hpp"
#include "terrain/maps/raster_layer.hpp"
#include "terrain/surface_domain.hpp"

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::terrain {

/// Lines for people.
struct MapFindings {
    std::vector<std::string> notes;    ///< what there is
    std::vector<std::string> warnings; ///< what is probably wrong, and what to try
};

/// "longitude -180 to 180 deg, latitude 90 to -90 deg" of the outer edges of a simple cylindrical map, from
/// left to right and from top to bottom; of a polar map the latitudes and of a plane the metres that it
/// covers.
[[nodiscard]] std::string edges_text(const MapFrame& frame);

/// Whether numbers, rows of `width`, are noise as they are and smooth with the bytes of each the other way
/// round: empty, or which type they are, integers of 16 bits or reals of 32 bits. `values`: offset + scale *
/// number.
[[nodiscard]] std::string swapped_bytes(std::span<const double> values, std::int64_t width, double scale = 1,
                                        double offset = 0);

/// Phrase on a map whose keys place it half a turn or more from where its label does; empty: they agree.
[[nodiscard]] std::string moved_from_label(const MapFrame& by_keys, const MapFrame& by_label);

/// Whether the map above fits the one below if it is turned by half a turn about the pole, and does not as
/// it is: one counts longitudes from 0 to 360 degrees, the other from -180 to 180.
[[nodiscard]] bool fits_half_a_turn_away(const SurfaceDomain& domain, const HeightRaster& above,
                                         const HeightRaster& below);

/// Phrase on heights of a whole body that are too small or too large for its radius, as in another unit or
/// without their scale; empty: plausible.
[[nodiscard]] std::string odd_relief(const HeightRaster& map, const SurfaceDomain& domain);

} // namespace obscura::terrain
