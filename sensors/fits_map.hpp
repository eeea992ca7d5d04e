// SPDX-License-Identifier: Apache-2.0
// Sensor calibration maps as FITS images, through cfitsio.
#pragma once

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace obscura::sensors {

/// Reads a two-dimensional image of exactly width x height finite numbers of at least `least`. The first row
/// of the file is row 0 of the array. Throws InputError with one line naming the file.
[[nodiscard]] std::vector<float> read_fits_map(const std::filesystem::path& file, std::int32_t width,
                                               std::int32_t height, double least);

/// Writes a map with its unit (BUNIT) and a comment, replacing an existing file. Throws OutputError.
void write_fits_map(const std::filesystem::path& file, std::span<const float> map, std::int32_t width,
                    std::int32_t height, const std::string& unit, const std::string& comment);

} // namespace obscura::sensors
