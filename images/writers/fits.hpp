// SPDX-License-Identifier: Apache-2.0
// FITS images: 16-bit digital numbers, or planes of 32-bit floats.
#pragma once

#include "images/writers/card.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace obscura::images {

/// Writes unsigned 16-bit `pixels` (row-major, width * height, first row first) with `cards` in the header.
/// FITS counts rows upwards from the bottom, but row 0 of the image is the first row in the file, so viewers
/// that follow the convention show it mirrored; the header states it by ROWORDER = 'TOP-DOWN'. The file
/// appears complete or not at all. Throws OutputError.
void write_fits16(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                  std::span<const std::uint16_t> pixels, const Cards& cards);

/// Writes `planes` images of floats, one after the other in `values`, as a cube (one plane: a plain image).
/// `unit` is written as BUNIT.
void write_fits_float(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                      std::int32_t planes, std::span<const float> values, std::string_view unit,
                      const Cards& cards);

/// An image extension of a FITS file.
struct FitsPlane {
    std::string name; ///< EXTNAME
    std::string unit;
    std::span<const float> values;
};
/// Writes the cube and, after it, the images of `further`, each in its own HDU.
void write_fits_float(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                      std::int32_t planes, std::span<const float> values, std::string_view unit,
                      const Cards& cards, const std::vector<FitsPlane>& further);

} // namespace obscura::images
