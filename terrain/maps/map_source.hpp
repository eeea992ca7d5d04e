// SPDX-License-Identifier: Apache-2.0
// Raster of heights from a file: its samples, and its projection and unit from its label or from keys.
#pragma once

#include "terrain/geometry/map_frame.hpp"
#include "terrain/maps/map_findings.hpp"
#include "terrain/maps/raster_layer.hpp"
#include "terrain/surface_domain.hpp"

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace obscura::terrain {

/// What a file says about itself as a map; empty fields: it does not say.
struct MapLabel {
    std::optional<Projection> projection;
    std::optional<PixelTransform> transform;
    Registration registration = Registration::pixel;
    std::optional<HeightMeaning> meaning;
    /// Metres of a number as images/ reads it, and what is added.
    double scale_m = 1, offset_m = 0;
    /// What images/ reads: number_offset + number_scale * number of the file.
    double number_scale = 1, number_offset = 0;
    bool states_scale = false; ///< it has a unit, a scale or an offset
    std::vector<std::string>
        warnings; ///< phrases, such as on numbers of the label that contradict each other
};

/// Reads PDS3 labels (IMAGE_MAP_PROJECTION) and the tags of GeoTIFF files; of other formats nothing. Throws
/// InputError with one line if it cannot be read or states a projection that is not supported. `width` and
/// `height`: of the image.
[[nodiscard]] MapLabel read_map_label(const std::filesystem::path& file, std::int64_t width,
                                      std::int64_t height);

/// A source of heights as keys give it: what they say holds, and what they leave out is taken from the file.
struct MapKeys {
    std::filesystem::path file;
    std::optional<ProjectionKind> projection;
    Registration registration = Registration::pixel;
    Latitudes latitudes = Latitudes::planetocentric;
    /// Simple cylindrical: edges of the map.
    double left_rad = -3.141592653589793, right_rad = 3.141592653589793;
    double top_rad = 1.5707963267948966, bottom_rad = -1.5707963267948966;
    /// Polar stereographic: the meridian of the y axis. Polar stereographic and planar: the upper left corner
    /// and the size of a pixel.
    double centre_longitude_rad = 0;
    double left_m = 0, top_m = 0, pixel_m = 0;
    std::optional<HeightMeaning> meaning;
    double scale_m = 1, offset_m = 0; ///< of the numbers that the file's own scale gives
};

/// Where the samples of a map of that size are, by the keys or else by its label. Throws
/// std::invalid_argument, with a phrase for a message.
[[nodiscard]] MapFrame map_frame(const MapKeys& keys, const MapLabel& label, const SurfaceDomain& domain,
                                 std::int64_t width, std::int64_t height);

/// Opens the file: an image (images/image.hpp) of at most max_memory_samples, or a giant texture (.obt).
/// `domain`: the surface that heights count from. `found`: gets the lines to report. Throws InputError with
/// one line that names the file.
[[nodiscard]] HeightRaster open_map(const MapKeys& keys, const SurfaceDomain& domain, MapFindings& found);

} // namespace obscura::terrain
