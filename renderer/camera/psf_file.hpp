// SPDX-License-Identifier: Apache-2.0
// PSF images from a FITS file: measured, or exported by an optical design program.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

namespace obscura::renderer {

/// Image of a point source before integration over pixels; the point is in the middle. An axis of one sample
/// is not spread along that axis.
struct PsfImage {
    std::int32_t width = 0, height = 0;
    std::vector<double> values;   ///< row by row, top first; any unit
    double samples_per_pixel = 1; ///< OVERSAMP: along rows, and along columns if the next is 0
    /// OVERSAMY, samples per pitch of the rows; 0: not given, samples are square on the focal plane.
    double samples_per_row = 0;
    double field_x = 0, field_y = 0; ///< FIELDX, FIELDY: sensor pixel
    std::int32_t band = 0;           ///< BAND, from 1; 0: all

    /// Whether all light is in the point itself.
    [[nodiscard]] bool is_point() const { return width == 1 && height == 1; }
    [[nodiscard]] double sum() const;
    /// Value at a point relative to the middle, by linear interpolation; 0 outside.
    [[nodiscard]] double at(double x, double y) const;
};

/// Reads all images of a file: each image extension with data, each plane of a cube. Throws InputError.
[[nodiscard]] std::vector<PsfImage> read_psf_file(const std::filesystem::path& file);

} // namespace obscura::renderer
