// SPDX-License-Identifier: Apache-2.0
// Stars of a scene: catalogues as CSV tables, and totals.
#pragma once

#include "ephemeris/stars/star.hpp"
#include "renderer/scene/scene.hpp"
#include "renderer/scene/sky_object.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

namespace obscura::scene {

/// A type as catalogues write it, such as "G8III" or "K2 Ib-II": the letter O to M, the subclass (5 if there
/// is none), the first luminosity class that follows. Nothing for other letters, as of carbon stars.
[[nodiscard]] std::optional<SpectralType> parse_spectral_type(std::string_view text);

/// Stars of `file` not fainter than `limiting_magnitude`. Columns: ra_deg and dec_deg (J2000), Johnson v_mag;
/// then, if the catalogue has them, b_v, spectral_type and parallax_mas, which gives the luminosity class of
/// a type without one and is not applied to the place. Throws ConfigError.
[[nodiscard]] std::vector<scene::Star> read_stars(const std::filesystem::path& file,
                                                  double limiting_magnitude);

/// Stars of `file`, a table of directions x, y, z (J2000 axes, any length) and irradiances e1, e2, ... in
/// each of the scene's `bands`. Throws ConfigError.
[[nodiscard]] std::vector<SkyObject> read_star_irradiances(const std::filesystem::path& file,
                                                           std::size_t bands);

/// What the photometry of a star of a catalogue file depends on; its place is not set.
[[nodiscard]] Star photometric_star(const ephemeris::CatalogueStar& from, StarSpectrum spectrum);

/// Star of a scene by its number: those that it lists come first, those of its catalogue file follow, with
/// their places at J2000.0. `number`: less than the count of both.
[[nodiscard]] Star star_of(const Scene& scene, std::uint32_t number);

/// Number of the stars of a scene, listed ones and those of its catalogue file, and the faintest of them.
struct StarTotals {
    std::size_t count = 0;
    double faintest_v = 0; ///< 0 without stars
};
[[nodiscard]] StarTotals star_totals(const Scene& scene);

} // namespace obscura::scene
