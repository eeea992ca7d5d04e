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
/// FITS counts rows upwards from the bottom: row 0 of the image is the first row in the file, so viewers that
/// follow the convention show it mirrored; ROWORDER = 'TOP-DOWN' says so. Throws OutputError; the file
/// appears complete or not at all.
void write_fits16(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                  std::span<const std::uint16_t> pixels, const Cards& cards);

/// Writes `planes` images of floats, one behind the other in `values`, as a cube (a plain image if it is
/// one). `unit` goes into BUNIT.
void write_fits_float(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                      std::int32_t planes, std::span<const float> values, std::string_view unit,
                      const Cards& cards);

/// One image of a file with several.
struct FitsPlane {
    std::string name; ///< EXTNAME
    std::string unit;
    std::span<const float> values;
};
/// The same, with further images behind the first, each a unit of its own.
void write_fits_float(const std::filesystem::path& file, std::int32_t width, std::int32_t height,
                      std::int32_t planes, std::span<const float> values, std::string_view unit,
                      const Cards& cards, const std::vector<FitsPlane>& further);

} // namespace obscura::images
