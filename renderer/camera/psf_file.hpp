// SPDX-License-Identifier: Apache-2.0
// Point spread functions from a FITS file: measured, or from a program for optical design.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace obscura::renderer {

/// One image of a point of light: before the pixels integrate it, the point itself in its middle.
struct PsfImage {
    std::int32_t width = 0, height = 0;
    std::vector<double> values;      ///< row by row, top first; any unit
    double samples_per_pixel = 1;    ///< OVERSAMP
    double field_x = 0, field_y = 0; ///< FIELDX, FIELDY: the sensor's pixel that it belongs to
    std::int32_t band = 0;           ///< BAND, from 1; 0: all

    [[nodiscard]] double sum() const;
    /// Value at a point, from the middle, by linear interpolation; 0 outside.
    [[nodiscard]] double at(double x, double y) const;
};

/// All images of a file: each image extension with data, planes of a cube apart. Throws InputError.
[[nodiscard]] std::vector<PsfImage> read_psf_file(const std::filesystem::path& file);

} // namespace obscura::renderer
