// FITS images: 16-bit digital numbers, or planes of 32-bit floats.
#pragma once

#include "transports/file/card.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string_view>

namespace obscura::transports {

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

} // namespace obscura::transports
