// SPDX-License-Identifier: Apache-2.0
// Star catalogues as CSV tables.
#pragma once

#include "renderer/scene/scene.hpp"

#include <filesystem>
#include <vector>

namespace obscura::scene {

/// Columns of a catalogue: J2000 right ascension and declination in degrees, Johnson V and B-V in magnitudes.
inline constexpr const char* star_columns = "ra_deg,dec_deg,v_mag,b_v";

/// Stars of `file` not fainter than `limiting_magnitude`. Throws ConfigError.
[[nodiscard]] std::vector<scene::Star> read_stars(const std::filesystem::path& file,
                                                  double limiting_magnitude);

} // namespace obscura::scene
