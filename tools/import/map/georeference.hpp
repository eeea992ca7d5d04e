// SPDX-License-Identifier: Apache-2.0
// Place of a map's samples on its body, from GDAL's description or from a PDS3 label.
#pragma once

#include "images/readers/pds_label.hpp"
#include "tools/gdal/protocol.hpp"
#include "tools/import/map/map_settings.hpp"

#include <optional>
#include <string>

namespace obscura::tools {

struct Georeference {
    terrain::Projection projection;
    terrain::PixelTransform transform{0, 1, 0, 0, 0, -1};
    terrain::Registration registration = terrain::Registration::pixel;
    /// Semi-axes of the label's or file's body; 0: it states none.
    Vec3 radii_m;
    /// Not one of the projections of terrain::Projection, or turned in it: `projection` and `transform` mean
    /// nothing.
    bool foreign = false;
    /// Part of the file that is taken: rows beyond a pole and columns beyond a full turn are not.
    std::int64_t first_row = 0, width = 0, height = 0;
    /// From GDAL's coordinate system: PROJ can say whether the projection is the same.
    bool by_system = false;
};

/// `label`: PDS3 label of the file, which goes before what GDAL makes of it; may be null. Throws InputError
/// `name: ...` if the file does not say where its samples are.
[[nodiscard]] Georeference georeference(const GdalMap& map, const images::PdsLabel* label,
                                        const MapSettings& settings, const std::string& name,
                                        MapRemarks& remarks);

/// Leaves out rows whose samples lie beyond a pole and columns that repeat others after a full turn.
void crop(Georeference& place, const std::string& name, MapRemarks& remarks);

/// The transform of a rounded label made whole: a simple cylindrical map that misses a full turn, two poles
/// or a whole number of pixels per degree by less than 1e-4 of its size and half a pixel gets it.
void make_whole(Georeference& place, const std::string& name, MapRemarks& remarks);

/// Grids of nodes that come as pixels, whose outer samples and not edges lie at the poles or a turn apart,
/// get their registration; no sample moves.
void find_nodes(Georeference& place, const std::string& name, MapRemarks& remarks);

} // namespace obscura::tools
