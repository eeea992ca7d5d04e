// SPDX-License-Identifier: Apache-2.0
// Picture files that the published client asks the server to save: TIFF, OpenEXR, FITS, PNG.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string_view>
#include <vector>

namespace obscura::serve::compatible {

/// Planes of a picture, first row on top.
struct PicturePlanes {
    std::int32_t width = 0, height = 0;
    std::vector<std::vector<float>> planes{}; ///< 1, 3 or 4
    std::string_view unit{};
};

/// Writes the numbers as they are; the format by the ending .tif, .tiff, .exr, .fits or .fit. With .png: as
/// save_integers() with 8 bits. Throws Failure (bad_argument) with the endings that there are, OutputError.
void save_floats(const std::filesystem::path& file, const PicturePlanes& picture);

/// Writes 0 to 1 as 0 to full scale of `bits`, 1 to 16, rounded; all else is cut. By .tif, .tiff or .png; of
/// more than 8 bits PNG has one plane only. Throws likewise.
void save_integers(const std::filesystem::path& file, const PicturePlanes& picture, int bits);

} // namespace obscura::serve::compatible
