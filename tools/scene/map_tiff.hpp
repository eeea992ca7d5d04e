// SPDX-License-Identifier: Apache-2.0
// GeoTIFF writer for levels of giant textures.
#pragma once

#include "terrain/obt/obt_file.hpp"

#include <cstdint>
#include <filesystem>
#include <functional>

namespace obscura::tools {

/// Writes a level of all planes as an uncompressed GeoTIFF (BigTIFF above 2 GB) with projection and
/// transform: u8, i16 and u16 samples whose values are their numbers as they are, others as f32 values.
/// Missing samples are the number that the file states, or NaN. `progress`, called with rows done, may return
/// false to interrupt; nothing is left then, and the result is false. Throws InputError, OutputError.
bool write_map_tiff(const std::filesystem::path& file, const terrain::ObtFile& texture, int level,
                    const std::function<bool(std::uint64_t rows)>& progress);

} // namespace obscura::tools
