// SPDX-License-Identifier: Apache-2.0
// Place of a map on its body by the IMAGE_MAP_PROJECTION object of a PDS3 label: the one reader of scenes and
// of the import.
#pragma once

#include "terrain/geometry/map_frame.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::images {
class PdsLabel;
}

namespace obscura::terrain {

/// What is said in place of the label, and how messages advise to say it.
struct Pds3Overrides {
    std::optional<Vec3> radii_m{}; ///< where the label states none
    std::optional<Latitudes> latitudes{};
    bool west_positive = false; ///< longitudes of the label grow westwards
    std::string_view radius_hint{}, edges_hint{};
};

struct Pds3Place {
    Projection projection;
    PixelTransform transform{0, 1, 0, 0, 0, -1};
    Registration registration = Registration::pixel;
    /// Semi-axes of the label's body; 0: it states none.
    Vec3 radii_m;
    /// Not one of the projections of Projection: `projection` and `transform` mean nothing.
    bool foreign = false;
    std::vector<std::string> warnings, notes; ///< lines
};

/// Whether the label has a map projection.
[[nodiscard]] bool has_pds3_map(const images::PdsLabel& label);

/// Semi-axes of the label's body, m; 0: it states none.
[[nodiscard]] Vec3 pds3_radii_m(const images::PdsLabel& label);

/// The place of an image of that size.
///
/// The Planetary Science Data Dictionary defines SAMPLE_PROJECTION_OFFSET and LINE_PROJECTION_OFFSET as the
/// place of the projection's origin counted from line and sample 1,1, the first pixel; the position of a
/// pixel is its middle. So the origin lies `offset` pixels right of and below the middle of the first one, as
/// LOLA's labels and GDAL have it. Labels that count from 1 (MOLA, older ISIS) or have the other sign are
/// told by the edges that they state, which go before the offsets if they fit the size of the image; without
/// edges, in polar maps, by a pole that would be in the middle of the image.
///
/// MAP_RESOLUTION goes before MAP_SCALE in simple cylindrical maps, whose scale is rounded in many labels,
/// and after it in polar ones, whose resolution is. Throws InputError `name: ...`.
[[nodiscard]] Pds3Place read_pds3_place(const images::PdsLabel& label, std::int64_t columns,
                                        std::int64_t rows, const std::string& name,
                                        const Pds3Overrides& overrides);

} // namespace obscura::terrain
