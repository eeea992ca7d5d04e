// SPDX-License-Identifier: Apache-2.0
// Tags of a GeoTIFF file, not yet interpreted: keys, tie points, scale and offset of its numbers.
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace obscura::images {

/// GeoTIFF 1.1 (OGC 19-008) and the metadata that GDAL adds. All empty in a TIFF file without them.
struct GeoTiff {
    std::map<std::uint16_t, double> keys; ///< GeoKeys that are numbers
    std::vector<double> pixel_scale, tie_points, transformation;
    std::optional<double> scale, offset; ///< value = offset + scale * number, of the first plane
    std::string unit;                    ///< of the first plane
};

/// Whether the file begins as a TIFF does. Throws InputError if it cannot be opened.
[[nodiscard]] bool is_tiff(const std::filesystem::path& file);
/// Throws InputError if the file is no TIFF.
[[nodiscard]] GeoTiff read_geo_tiff(const std::filesystem::path& file);

} // namespace obscura::images
