// SPDX-License-Identifier: Apache-2.0
// Star catalogues as CSV tables.
#pragma once

#include "renderer/scene/scene.hpp"

#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace obscura::scene {

/// A type as catalogues write it, such as "G8III" or "K2 Ib-II": the letter O to M, the subclass (5 if there
/// is none), the first luminosity class that follows. Nothing for other letters, as of carbon stars.
[[nodiscard]] std::optional<SpectralType> parse_spectral_type(std::string_view text);

/// Stars of `file` not fainter than `limiting_magnitude`. Columns: ra_deg and dec_deg (J2000), Johnson v_mag;
/// then, if the catalogue has them, b_v and spectral_type. Throws ConfigError.
[[nodiscard]] std::vector<scene::Star> read_stars(const std::filesystem::path& file,
                                                  double limiting_magnitude);

} // namespace obscura::scene
